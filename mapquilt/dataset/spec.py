"""Specification of a data set, as YAML: its keys, each with its meaning, unit, default and an example."""

from __future__ import annotations

import difflib
import math
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from mapping.grid.frame_perturbation import FramePerturbationRanges
from mapping.io.safe_load import read_yaml, yaml_value
from mapping.settings import PARTICLE, MappingSettings
from mapping.wording import did_you_mean
from mapquilt.leaves import leaf_name, with_assignments
from mapquilt.runs.open_world import is_world_file
from mapquilt.settings import COMBINED, ExperimentConfig, check_parts, lidar_at_rate, max_yaw_of
from sim.mission.settings import MissionSettings, PolicyName, Starts
from sim.physics.drive import Drive
from sim.physics.robot import MAX_ROBOTS, RobotSettings
from worlds.families.registry import FAMILIES
from worlds.importing.plan_file import PlanOptions

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

READY = ("smoke", "standard", "hard", "teams", "noise-sweep", "benchmark", "little-overlap", "poses", "mixture")
"""Names of the built-in specifications."""

LICENCE = "CC-BY-4.0"
"""Licence of generated data."""

SPLITS = ("train", "validation", "test")
"""Names of splits."""

SHARE_TOLERANCE = 0.011
"""Greatest deviation of the sum of the shares from 1: thirds may be written as 0.33."""

MOST = 100_000
"""Most missions of a group, and samples of a mission: a plan of more does not fit into memory."""

Count = Annotated[int, Field(ge=0)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Overlap = tuple[float, float]


def _key(about: str, unit: str, example: Any, **limits: Any) -> Any:
    """Describe a key: what it means, its unit, and an example of its value."""
    return Field(description=about, json_schema_extra={"unit": unit}, examples=[example], **limits)


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class MissionsSpec(_Strict):
    """Specify ``count`` missions, each in a world of its own, or all in the world of one file."""

    world: Annotated[str, _key("family, or file of a world or plan", "", "office")]
    width: Annotated[Positive | None, _key("width of a family's world", "m", 25)] = None
    height: Annotated[Positive | None, _key("height of a family's world", "m", 18)] = None
    plan_resolution: Annotated[Positive | None, _key("size of a pixel of a picture or SVG", "m", 0.05)] = None
    level: Annotated[str | None, _key("level of a `building.yaml`", "", "L1")] = None
    building: Annotated[
        str | None, _key("building that the plan is a storey of; storeys of one building are alike", "", "clinic")
    ] = None
    from_map: Annotated[bool, _key("mend the plan of a real place", "", True)] = False
    plan_sha256: Annotated[
        str | None, _key("hash of the plan that a data set holds; `dataset make` writes it", "", None)
    ] = None
    licence: Annotated[str, _key("licence of the plan, and of the data made from it", "", "CC0-1.0")] = LICENCE
    count: Annotated[int, _key("number of missions", "", 10, ge=1, le=MOST)]
    seeds: Annotated[
        tuple[Count, Count] | None,
        _key("seeds of worlds and missions, first and last, in turn; without, derived from `seed`", "", [100, 109]),
    ] = None
    robots: Annotated[int, _key("robots of a team", "", 3, ge=1, le=MAX_ROBOTS)] = 3
    duration: Annotated[Positive, _key("duration of a mission", "s", 120)] = 120.0
    lidar: Annotated[str, _key("lidar, of `mapquilt lidars`", "", "rplidar_a1")] = "default"
    rate: Annotated[Positive | None, _key("scan rate; without, the lidar's own", "Hz", 5)] = None
    starts: Annotated[Starts, _key("placement of the robots: random, spread, close", "", "close")] = "random"
    drive: Annotated[Drive, _key("velocity (ideal), or wheels that slip", "", "velocity")] = "velocity"
    policy: Annotated[PolicyName, _key("explore, or patrol between goals of its own", "", "patrol")] = "explore"
    overlap: Annotated[
        Overlap | None, _key("least and greatest true overlap of any two robots", "fraction", [0.3, 0.5])
    ] = None
    overlap_strata: Annotated[
        tuple[Overlap, ...],
        _key("ranges of overlap that missions take in turn", "fraction", [[0, 0.1], [0.3, 0.6]]),
    ] = ()

    @property
    def plan(self) -> PlanOptions:
        """Return how the plan of a real place is read."""
        return PlanOptions(self.plan_resolution, self.level, self.from_map)

    @property
    def kind(self) -> str:
        """Return the name that alike worlds share: of their building, or else of the family or file."""
        return self.building or self.world

    @property
    def place(self) -> str:
        """Return the name of the world for records: the family, or the file without folder and ending."""
        return Path(self.world).stem if is_world_file(self.world) else self.world

    def of_mission(self, number: int) -> MissionsSpec:
        """Return the specification of one mission, whose overlap is that of its stratum."""
        if not self.overlap_strata:
            return self
        stratum = self.overlap_strata[number % len(self.overlap_strata)]
        return self.model_copy(update={"overlap": stratum, "overlap_strata": ()})

    def settings(self) -> MissionSettings:
        """Return the settings of the missions. Raises ``ValueError`` naming a value out of range."""
        robot = RobotSettings(lidar=lidar_at_rate(self.lidar, self.rate))
        return MissionSettings(
            (robot,) * self.robots, self.duration, self.starts, self.drive, self.policy, overlap=self.overlap
        )

    @field_validator("world")
    @classmethod
    def _check_world(cls, world: str) -> str:
        if world not in FAMILIES and not is_world_file(world):
            raise ValueError(
                f"is {world}, must be a file or one of {', '.join(FAMILIES)}{did_you_mean(world, FAMILIES)}"
            )
        return world

    @model_validator(mode="after")
    def _check(self) -> MissionsSpec:
        if self.policy == "replay":
            raise ValueError("policy is 'replay', must be explore or patrol: a data set has no trajectories to replay")
        if self.overlap is not None and self.overlap_strata:
            raise ValueError("overlap and overlap_strata are both given; leave one out")
        if self.seeds is not None and self.seeds[1] - self.seeds[0] + 1 < self.count:
            raise ValueError(f"seeds are {self.seeds[0]} to {self.seeds[1]}, fewer than count, {self.count}")
        for number in range(max(1, len(self.overlap_strata))):
            self.of_mission(number).settings()
        return self


class SamplesSpec(_Strict):
    """Specify the samples of each mission. Each list holds values that occur equally often."""

    per_mission: Annotated[int, _key("samples of each mission", "", 4, ge=1, le=MOST)] = 4
    noise: Annotated[
        tuple[Annotated[float, Field(ge=0.0, allow_inf_nan=False)], ...],
        _key("levels of noise: 0 exact, 1 an ordinary robot, 3 a bad one", "", [0, 1]),
    ] = (1.0,)
    poses: Annotated[
        tuple[str, ...],
        _key("poses that the robots map with: slam, odometry, truth, particle", "", ["slam", "odometry", "particle"]),
    ] = ("slam",)
    scale: Annotated[
        tuple[tuple[Positive, Positive], ...],
        _key("ranges of true metres per stated metre; [1, 1] is exact", "", [[0.5, 2], [1, 1]]),
    ] = ((0.5, 2.0),)
    max_rotation: Annotated[
        tuple[float, ...], _key("greatest rotation of a map's frame, 0 to 180", "degrees", [180, 10])
    ] = (180.0,)
    max_offset: Annotated[tuple[float, ...], _key("greatest offset of a map's frame", "m", [10])] = (10.0,)
    parts: Annotated[tuple[int, ...], _key("maps that the mission of each robot is cut into", "", [1, 2])] = (1,)
    resolution: Annotated[tuple[Positive, ...], _key("cell size", "m", [0.05, 0.1])] = (0.05,)
    sensor_model: Annotated[tuple[str, ...], _key("inverse sensor model", "", ["octomap"])] = ("octomap",)
    clear_range: Annotated[
        float, _key("range that beams without a return clear; one value, as the truth depends on it", "m", 12, ge=0.0)
    ] = 0.0
    set: Annotated[
        dict[str, tuple[float | str, ...]],
        _key(
            "values of any other setting of sensing (each noise component), mapping or perturbation",
            "its own",
            {"sensing.lidar.range_sigma": [0.01, 0.05]},
        ),
    ] = {}

    def mapping(self, poses: str, resolution: float, sensor_model: str) -> MappingSettings:
        """Return the settings that map at ``poses``; those of the particle filter count hits, whatever the model."""
        if poses == PARTICLE:
            return MappingSettings(resolution=resolution, clear_range=self.clear_range, mapper=PARTICLE)
        return MappingSettings(poses, resolution, sensor_model, self.clear_range)

    @model_validator(mode="after")
    def _check(self) -> SamplesSpec:
        lists = ("noise", "poses", "scale", "max_rotation", "max_offset", "parts", "resolution", "sensor_model")
        for name in lists:
            if not getattr(self, name):
                raise ValueError(f"{name} lists no value")
        combined = math.prod(len(getattr(self, name)) for name in lists) * math.prod(map(len, self.set.values()))
        if combined > MOST:
            raise ValueError(f"the lists combine to {combined} samples of a mission, must be at most {MOST}")
        for low, high in self.scale:
            FramePerturbationRanges(low, high)
        for angle in self.max_rotation:
            max_yaw_of(angle)
        for offset in self.max_offset:
            FramePerturbationRanges(max_offset=offset)
        for parts in self.parts:
            check_parts(parts)
        for model in self.sensor_model:
            MappingSettings(sensor_model=model)
        for poses in self.poses:
            self.mapping(poses, 0.05, self.sensor_model[0])
        MappingSettings(clear_range=self.clear_range)
        for name, values in self.set.items():
            if not values:
                raise ValueError(f"set.{name} lists no value")
            if leaf_name(ExperimentConfig(), name, COMBINED) == "mapping.clear_range":
                raise ValueError("set.mapping.clear_range: use the key clear_range, one value for all samples")
            for value in values:
                with_assignments(ExperimentConfig(), "set", [f"{name}={value}"], COMBINED)
        return self


class DatasetSpec(_Strict):
    """Specify a data set."""

    name: Annotated[str, _key("name of the data set", "", "offices", pattern=r"^[A-Za-z0-9_.-]+$")]
    seed: Annotated[Count, _key("seed of everything", "", 1)] = 1
    missions: Annotated[
        tuple[MissionsSpec, ...],
        _key("groups of missions, with the keys of `missions`", "", [{"world": "office", "count": 4}], min_length=1),
    ]
    samples: Annotated[SamplesSpec, _key("samples, with the keys of `samples`", "", {"noise": [0, 1]})] = SamplesSpec()
    other_worlds: Annotated[Count, _key("negative pairs, whose maps are of two worlds", "", 100, le=10 * MOST)] = 0
    alike_worlds: Annotated[
        Count,
        _key("more negative pairs, of two worlds of one family, or two storeys of one building", "", 50, le=10 * MOST),
    ] = 0
    splits: Annotated[
        dict[str, Positive],
        _key(
            f"shares of each group's worlds, of {', '.join(SPLITS)}, with sum 1; no world is in two splits",
            "",
            {"train": 0.8, "test": 0.2},
        ),
    ] = {"train": 0.6, "validation": 0.2, "test": 0.2}

    @property
    def scans(self) -> float:
        """Number of scans of all robots in all missions."""
        return sum(
            each.count * sum(robot.lidar.rate for robot in each.of_mission(0).settings().robots) * each.duration
            for each in self.missions
        )

    @property
    def total(self) -> int:
        """Number of samples."""
        return self.samples.per_mission * sum(missions.count for missions in self.missions)

    @field_validator("splits")
    @classmethod
    def _check_splits(cls, splits: dict[str, float]) -> dict[str, float]:
        if not splits:
            raise ValueError(f"names no split; known are {', '.join(SPLITS)}")
        for name in splits:
            if name not in SPLITS:
                raise ValueError(f"{name} is no split, must be one of {', '.join(SPLITS)}{did_you_mean(name, SPLITS)}")
        total = sum(splits.values())
        if not math.isclose(total, 1.0, abs_tol=SHARE_TOLERANCE):
            raise ValueError(f"the shares add up to {total:g}, must be 1")
        return splits

    @model_validator(mode="after")
    def _check(self) -> DatasetSpec:
        if self.other_worlds + self.alike_worlds and sum(missions.count for missions in self.missions) < 2:
            raise ValueError(f"{'other_worlds' if self.other_worlds else 'alike_worlds'} needs at least two missions")
        return self


SECTIONS: dict[str, type[BaseModel]] = {"": DatasetSpec, "missions": MissionsSpec, "samples": SamplesSpec}
"""The parts of a specification by the key that holds them."""


def load_spec(source: str) -> DatasetSpec:
    """Load a built-in specification (``READY``) by name, or one in a YAML file.

    Raises ``ValueError`` naming the file, the field and the fault, ``OSError`` if the file cannot be read.
    """
    if source not in READY and not Path(source).exists():
        raise ValueError(
            f"{source}: no such file, and no ready specification, which are {', '.join(READY)}"
            f"{did_you_mean(source, READY)}"
        )
    record = yaml_value(ready_spec(source).encode(), source) if source in READY else read_yaml(Path(source))
    if not isinstance(record, dict):
        raise ValueError(f"{source}: holds no mapping of fields")
    try:
        return DatasetSpec.model_validate(record)
    except ValidationError as error:
        faults = error.errors()
        first = next((each for each in faults if each["type"] == "extra_forbidden"), faults[0])
        raise ValueError(f"{source}: {_fault_text(first)}") from None


def _fault_text(fault: ErrorDetails) -> str:
    """Describe a fault of a specification: its key, its value if that is one, and what is allowed."""
    where = ".".join(str(part) for part in fault["loc"])
    if fault["type"] == "extra_forbidden":
        return f"{where}: is no key; {_nearest(fault['loc'])}"
    if fault["type"] == "missing":
        return f"{where}: is missing"
    if fault["type"] == "value_error":
        return f"{where}: {fault['msg'].removeprefix('Value error, ')}".removeprefix(": ")
    value = fault["input"]
    limit = fault["msg"].replace("Input should", "must")
    if isinstance(value, dict | list | tuple):
        return f"{where}: {limit}, not a {'mapping' if isinstance(value, dict) else 'list'}"
    return f"{where}: is {_text(value)[:80]}, {limit}"


def _nearest(place: tuple[int | str, ...]) -> str:
    """Suggest the known key that is nearest to an unknown one, of any part, or list those of its part."""
    unknown, section = str(place[-1]), "" if len(place) == 1 else str(place[0])
    own = list(SECTIONS[section].model_fields)
    elsewhere = {f"{name}.{key}".strip("."): key for name, model in SECTIONS.items() for key in model.model_fields}
    exact = [full for full, key in elsewhere.items() if key == unknown]
    close = difflib.get_close_matches(unknown, own, n=1)
    similar = difflib.get_close_matches(unknown, elsewhere.values(), n=1)
    found = [*exact, *close, *(full for full, key in elsewhere.items() if key in similar)]
    return f"did you mean {found[0]}?" if found else f"known are {', '.join(own)}"


def key_rows(section: str) -> list[tuple[str, str, str, str, str]]:
    """List the keys of a section of ``SECTIONS``: name, meaning, unit, default and example, as text."""
    rows = []
    for name, field in SECTIONS[section].model_fields.items():
        extra = field.json_schema_extra
        unit = str(extra["unit"]) if isinstance(extra, dict) else ""
        default = "required" if field.is_required() else _text(field.get_default())
        example = _text(field.examples[0]) if field.examples else ""
        rows.append((name, field.description or "", unit, default, example))
    return rows


def _text(value: Any) -> str:
    """Write a value as in YAML, on one line."""
    if isinstance(value, BaseModel):
        return "the defaults below"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_text(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_text, value)) + "]"
    if value is None or isinstance(value, bool):
        return {None: "none", True: "true", False: "false"}[value]
    return f"{value:g}" if isinstance(value, float) else str(value)


def ready_spec(name: str) -> str:
    """Return the YAML text of a built-in specification; the plans that it names lie beside it."""
    folder = resources.files("mapquilt.dataset") / "specs"
    text = (folder / f"{name}.yaml").read_text(encoding="utf-8")
    return text.replace('world: "plans/', f'world: "{folder}/plans/')
