"""All that one level of a study is made with: mission, sensing, mapping, disguise and merging."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

from mapping.settings import MappingSettings, Poses
from mapquilt.cli.options.merge import searched_scales
from mapquilt.cli.options.sensing import chosen_lidar, disguise_ranges
from mapquilt.runs.sample import SampleSettings
from merge.settings import MergeSettings
from merge.verification.settings import AcceptanceSettings
from sim.mission.robot import RobotSettings
from sim.mission.settings import MissionSettings, PolicyName
from sim.mission.starts import Starts
from sim.physics.drive import Drive
from sim.sensors.lidar_presets import lidar_preset
from sim.sensors.settings import SensingSettings

DERIVED = ("robots", "duration", "beams", "overlap")
"""Settings of a mission whose levels are cut out of one mission: so many robots, so long, every so many-th beam."""


@dataclass(frozen=True)
class ExperimentConfig:
    """Each setting under the name that the command line gives it; ``world`` None is that of the mission.

    The first eleven make the mission, the next ten the maps, the last two the merge. Raises ``ValueError`` naming the
    setting and the value.
    """

    world: str | None = None
    width: float | None = None
    height: float | None = None
    robots: int = 3
    duration: float = 120.0
    lidar: str = "default"
    rate: float | None = None
    beams: int | None = None
    starts: Starts = "random"
    drive: Drive = "velocity"
    policy: PolicyName = "explore"
    overlap: tuple[float, float] | None = None
    noise: float = 1.0
    components: tuple[tuple[str, float], ...] = ()
    poses: Poses = "odometry"
    scale: str = "hidden"
    max_rotation: float = 180.0
    max_offset: float = 10.0
    resolution: float = 0.05
    model: str = "octomap"
    clear_range: float = 0.0
    parts: int = 1
    search: str = "auto"
    min_confidence: float = AcceptanceSettings.min_confidence

    def __post_init__(self) -> None:
        self.mission()
        self.sample(0)
        self.merge("quilt", as_published=False)
        if self.robots * self.parts < 2:
            raise ValueError(f"robots is {self.robots}, must be at least 2: there is nothing to merge")
        beams = lidar_preset(self.lidar).lidar.beams
        if self.beams is not None and not (self.beams >= 1 and beams % self.beams == 0):
            raise ValueError(f"beams is {self.beams}, must divide the {beams} beams of the lidar {self.lidar}")

    def mission(self) -> MissionSettings:
        """The mission that is simulated, all beams kept."""
        robot = RobotSettings(lidar=chosen_lidar(self.lidar, self.rate))
        return MissionSettings(
            (robot,) * self.robots, self.duration, self.starts, self.drive, self.policy, overlap=self.overlap
        )

    def sample(self, seed: int) -> SampleSettings:
        return SampleSettings(
            SensingSettings(self.noise, self.components),
            MappingSettings(self.poses, self.resolution, self.model, self.clear_range),
            disguise_ranges(self.scale, self.max_rotation, self.max_offset),
            self.parts,
            seed,
        )

    def merge(self, method: str, as_published: bool) -> MergeSettings:
        acceptance = AcceptanceSettings(min_confidence=self.min_confidence)
        return MergeSettings(method, searched_scales(self.search), as_published, acceptance)

    def drive_part(self) -> ExperimentConfig:
        """This setup with all but what the simulation depends on at its default; equal ones share a mission."""
        names = ("world", "width", "height", "lidar", "rate", "starts", "drive", "policy")
        return replace(ExperimentConfig(), **{name: getattr(self, name) for name in names})

    def place_part(self) -> ExperimentConfig:
        """This setup without what the true places do not depend on; equal ones share them."""
        kept = {field.name for field in fields(self)} - _OF_THE_MAPS - _OF_THE_MERGE
        return replace(ExperimentConfig(), **{name: getattr(self, name) for name in kept | {"clear_range", "parts"}})

    def map_part(self) -> ExperimentConfig:
        """This setup without the merge's settings; equal ones share their maps."""
        return replace(self, **{name: getattr(ExperimentConfig(), name) for name in _OF_THE_MERGE})


_OF_THE_MERGE = frozenset(("search", "min_confidence"))
_OF_THE_MAPS = frozenset(
    ("noise", "components", "poses", "scale", "max_rotation", "max_offset", "resolution", "model", "clear_range")
) | {"parts"}
