"""What a data set is made of: the specification, as YAML."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from mapping.grid.frame_perturbation import FramePerturbationRanges
from mapping.io.safe_load import read_yaml, yaml_value
from mapping.settings import MappingSettings
from mapquilt.leaves import with_assignments
from mapquilt.settings import COMBINED, ExperimentConfig, check_parts
from sim.mission.robot import RobotSettings
from sim.mission.settings import MissionSettings
from sim.sensors.lidar_presets import lidar_preset

READY = ("smoke", "standard", "noise-sweep", "benchmark", "little-overlap")
"""The specifications that ship."""

Count = Annotated[int, Field(ge=0)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class MissionsSpec(_Strict):
    """``count`` missions of ``robots`` robots for ``duration`` s in worlds of one family, each in one of its own.

    ``world`` names a family, or the file of a world or plan, whose missions then differ by their starts alone;
    ``width`` and ``height`` [m] size a family, ``plan_resolution`` [m a pixel] a plan that is a bare picture.
    ``overlap`` is the least and greatest share that the true footprints of any two robots are to have in common.
    """

    world: str
    width: Positive | None = None
    height: Positive | None = None
    plan_resolution: Positive | None = None
    count: Annotated[int, Field(ge=1)]
    robots: Annotated[int, Field(ge=1)] = 3
    duration: Positive = 120.0
    lidar: str = "default"
    overlap: tuple[float, float] | None = None

    def settings(self) -> MissionSettings:
        """The missions' settings. Raises ``ValueError`` naming what is out of range."""
        robot = RobotSettings(lidar=lidar_preset(self.lidar).lidar)
        return MissionSettings((robot,) * self.robots, self.duration, overlap=self.overlap)

    @model_validator(mode="after")
    def _check(self) -> MissionsSpec:
        self.settings()
        return self


class SamplesSpec(_Strict):
    """How often each mission is sensed, and the values that the samples take in turn, each as often as the others.

    ``scale`` holds ranges of true metres per stated metre, ``parts`` into how many maps each robot's time is cut.
    ``set`` lists values of any other setting of sensing, mapping or perturbation by its dotted name.
    """

    per_mission: Annotated[int, Field(ge=1)] = 4
    noise: tuple[Annotated[float, Field(ge=0.0, allow_inf_nan=False)], ...] = (1.0,)
    poses: tuple[str, ...] = ("odometry",)
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
    """A whole data set. ``other_worlds`` counts pairs of maps from two worlds, which no merger may accept; ``splits``
    are shares of each family's worlds, so that no world is in two splits."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]+$")]
    seed: Count = 1
    missions: Annotated[tuple[MissionsSpec, ...], Field(min_length=1)]
    samples: SamplesSpec = SamplesSpec()
    other_worlds: Count = 0
    splits: dict[str, Positive] = {"train": 0.6, "validation": 0.2, "test": 0.2}

    @model_validator(mode="after")
    def _check(self) -> DatasetSpec:
        if not self.splits:
            raise ValueError("splits names no split")
        if self.other_worlds and sum(missions.count for missions in self.missions) < 2:
            raise ValueError("other_worlds needs at least two missions")
        return self


def load_spec(source: str) -> DatasetSpec:
    """The specification of a ready name (``READY``) or in a YAML file.

    Raises ``ValueError`` that names the file, the field and what is wrong with it; ``OSError`` where it cannot be read.
    """
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
    """The YAML text of a specification that ships."""
    return (resources.files("mapquilt.dataset") / "specs" / f"{name}.yaml").read_text(encoding="utf-8")
