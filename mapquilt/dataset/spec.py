"""Specification of a data set, as YAML."""

from __future__ import annotations

import difflib
from importlib import resources
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from mapping.grid.frame_perturbation import FramePerturbationRanges
from mapping.io.safe_load import read_yaml, yaml_value
from mapping.settings import MappingSettings
from mapquilt.leaves import with_assignments
from mapquilt.settings import COMBINED, ExperimentConfig, check_parts
from sim.mission.settings import MissionSettings
from sim.physics.robot import RobotSettings
from sim.sensors.lidar_presets import lidar_preset
from worlds.importing.plan_file import PlanOptions

READY = ("smoke", "standard", "noise-sweep", "benchmark", "little-overlap")
"""Names of the built-in specifications."""

Count = Annotated[int, Field(ge=0)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class MissionsSpec(_Strict):
    """Specify ``count`` missions of ``robots`` robots for ``duration`` [s], each in a world of its own.

    ``world`` names a family, or a file of a world or floor plan, whose missions then differ only in their starts.
    ``width`` and ``height`` [m] size a family's world, ``plan_resolution`` [m/pixel] a plan without a resolution.
    ``overlap`` bounds the overlap of the true footprints of any two robots.
    """

    world: str
    width: Positive | None = None
    height: Positive | None = None
    plan_resolution: Positive | None = None
    level: str | None = None
    from_map: bool = False
    count: Annotated[int, Field(ge=1)]
    robots: Annotated[int, Field(ge=1)] = 3
    duration: Positive = 120.0
    lidar: str = "default"
    overlap: tuple[float, float] | None = None

    @property
    def plan(self) -> PlanOptions:
        """Return how the plan of a real place is read."""
        return PlanOptions(self.plan_resolution, self.level, self.from_map)

    def settings(self) -> MissionSettings:
        """Return the settings of the missions. Raises ``ValueError`` naming a value out of range."""
        robot = RobotSettings(lidar=lidar_preset(self.lidar).lidar)
        return MissionSettings((robot,) * self.robots, self.duration, overlap=self.overlap)

    @model_validator(mode="after")
    def _check(self) -> MissionsSpec:
        self.settings()
        return self


class SamplesSpec(_Strict):
    """Specify the number of samples per mission, and the values of their settings, which occur equally often.

    ``scale`` holds ranges of true metres per stated metre; ``parts`` are numbers of maps that each robot's mission is
    cut into. ``set`` lists values of any other setting of sensing, mapping or perturbation by its dotted name.
    """

    per_mission: Annotated[int, Field(ge=1)] = 4
    noise: tuple[Annotated[float, Field(ge=0.0, allow_inf_nan=False)], ...] = (1.0,)
    poses: tuple[str, ...] = ("slam",)
    scale: tuple[tuple[Positive, Positive], ...] = ((0.5, 2.0),)
    parts: tuple[int, ...] = (1,)
    resolution: tuple[Positive, ...] = (0.05,)
    sensor_model: tuple[str, ...] = ("octomap",)
    set: dict[str, tuple[float | str, ...]] = {}

    @model_validator(mode="after")
    def _check(self) -> SamplesSpec:
        for name in ("noise", "poses", "scale", "parts", "resolution", "sensor_model"):
            if not getattr(self, name):
                raise ValueError(f"{name} lists no value")
        for low, high in self.scale:
            FramePerturbationRanges(low, high)
        for parts in self.parts:
            check_parts(parts)
        for model in self.sensor_model:
            MappingSettings(sensor_model=model)
        for poses in self.poses:
            MappingSettings(poses)
        for name, values in self.set.items():
            if not values:
                raise ValueError(f"set.{name} lists no value")
            for value in values:
                with_assignments(ExperimentConfig(), "set", [f"{name}={value}"], COMBINED)
        return self


class DatasetSpec(_Strict):
    """Specify a data set. ``other_worlds`` is the number of negative pairs, whose maps are of two worlds; ``splits``
    are shares of each family's worlds, so that no world is in two splits."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]+$")]
    seed: Count = 1
    missions: Annotated[tuple[MissionsSpec, ...], Field(min_length=1)]
    samples: SamplesSpec = SamplesSpec()
    other_worlds: Count = 0
    splits: dict[str, Positive] = {"train": 0.6, "validation": 0.2, "test": 0.2}

    @property
    def total(self) -> int:
        """Number of samples."""
        return self.samples.per_mission * sum(missions.count for missions in self.missions)

    @model_validator(mode="after")
    def _check(self) -> DatasetSpec:
        if not self.splits:
            raise ValueError("splits names no split")
        if self.other_worlds and sum(missions.count for missions in self.missions) < 2:
            raise ValueError("other_worlds needs at least two missions")
        return self


def load_spec(source: str) -> DatasetSpec:
    """Load a built-in specification (``READY``) by name, or one in a YAML file.

    Raises ``ValueError`` naming the file, the field and the fault, ``OSError`` if the file cannot be read.
    """
    if source not in READY and not Path(source).exists():
        near = difflib.get_close_matches(source, READY, 1)
        raise ValueError(
            f"{source}: no such file, and no ready specification, which are {', '.join(READY)}"
            + (f" (did you mean {near[0]}?)" if near else "")
        )
    record = yaml_value(ready_spec(source).encode(), source) if source in READY else read_yaml(Path(source))
    if not isinstance(record, dict):
        raise ValueError(f"{source}: holds no mapping of fields")
    try:
        return DatasetSpec.model_validate(record)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the specification"
        raise ValueError(f"{source}: {where}: {first['msg']}; it is {str(first['input'])[:80]}") from None


def ready_spec(name: str) -> str:
    """Return the YAML text of a built-in specification."""
    return (resources.files("mapquilt.dataset") / "specs" / f"{name}.yaml").read_text(encoding="utf-8")
