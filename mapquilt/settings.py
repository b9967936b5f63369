"""One settings tree for everything: world, mission, sensing, mapping, frame perturbation and merge.

The command line, data-set specifications, studies and Python read and change the same tree, by the dotted names of
``mapquilt/leaves.py``.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from mapping.grid.frame_perturbation import FramePerturbationRanges
from mapping.numbers import parse_number, parse_range
from mapping.seeds import check_seed
from mapping.settings import MappingSettings
from mapquilt.leaves import Combined
from merge.settings import MergeSettings
from sim.mission.settings import CutSettings, MissionSettings, PolicyName, Starts
from sim.physics.drive import Drive
from sim.physics.robot import RobotSettings
from sim.policies.settings import BehaviourSettings
from sim.sensors.adversity.settings import AMOUNTS, LEVEL_ONE
from sim.sensors.lidar import Lidar
from sim.sensors.lidar_presets import lidar_preset, with_rate
from sim.sensors.odometry import OdometryNoise
from sim.sensors.range_noise import RangeNoise
from sim.sensors.settings import SensingSettings

MOST_PARTS = 20


def check_parts(parts: int) -> None:
    """Raise ``ValueError`` naming the value if a mission cannot be cut into so many parts."""
    if not 1 <= parts <= MOST_PARTS:
        raise ValueError(f"parts is {parts}, must lie between 1 and {MOST_PARTS}")


@dataclass(frozen=True)
class SampleSettings:
    """Choose how a mission becomes maps: sensing, mapping, the ranges that frame perturbations are drawn from, the
    number of ``parts`` that each robot's mission is cut into (one map each), and the ``seed`` of noise and frames.

    Raises ``ValueError`` naming the field and the value.
    """

    sensing: SensingSettings = field(default_factory=SensingSettings)
    mapping: MappingSettings = field(default_factory=MappingSettings)
    perturbation: FramePerturbationRanges = field(default_factory=FramePerturbationRanges)
    parts: int = 1
    seed: int = 7

    def __post_init__(self) -> None:
        check_parts(self.parts)
        check_seed(self.seed)


@dataclass(frozen=True)
class WorldSettings:
    """Choose the world: ``family``, a family or file (None: the experiment's own), and the ``width`` and ``height`` [m]
    of a family's world (None: usual)."""

    family: str | None = None
    width: float | None = None
    height: float | None = None


@dataclass(frozen=True)
class TeamSettings:
    """Choose a team of equal robots and their mission: ``duration`` [s], the ``lidar`` preset, its ``rate`` [Hz] and
    number of ``beams`` (None: the preset's), where robots start, what they drive on, how they choose goals, and the
    range of true ``overlap`` that any two footprints are cut to. ``behaviour`` tunes policies and navigation,
    ``cut`` the search for that overlap.

    Raises ``ValueError`` naming the field and the value.
    """

    robots: int = 3
    duration: float = 120.0
    lidar: str = "default"
    rate: float | None = None
    beams: int | None = None
    starts: Starts = "random"
    drive: Drive = "velocity"
    policy: PolicyName = "explore"
    overlap: tuple[float, float] | None = None
    behaviour: BehaviourSettings = field(default_factory=BehaviourSettings)
    cut: CutSettings = field(default_factory=CutSettings)

    def __post_init__(self) -> None:
        self.mission()
        beams = lidar_preset(self.lidar).lidar.beams
        if self.beams is not None and not (self.beams >= 1 and beams % self.beams == 0):
            raise ValueError(f"beams is {self.beams}, must divide the {beams} beams of the lidar {self.lidar}")

    def mission(self) -> MissionSettings:
        """Return the mission to simulate, with all beams of the lidar."""
        robot = RobotSettings(lidar=lidar_at_rate(self.lidar, self.rate))
        return MissionSettings(
            robots=(robot,) * self.robots,
            duration=self.duration,
            starts=self.starts,
            drive=self.drive,
            policy=self.policy,
            overlap=self.overlap,
            behaviour=self.behaviour,
            cut=self.cut,
        )


@dataclass(frozen=True)
class ExperimentConfig:
    """Hold all settings of an experiment. ``parts`` is the number of maps that each robot's mission is cut into."""

    world: WorldSettings = field(default_factory=WorldSettings)
    mission: TeamSettings = field(default_factory=TeamSettings)
    sensing: SensingSettings = field(default_factory=SensingSettings)
    mapping: MappingSettings = field(default_factory=MappingSettings)
    perturbation: FramePerturbationRanges = field(default_factory=FramePerturbationRanges)
    parts: int = 1
    merge: MergeSettings = field(default_factory=MergeSettings)

    def sample(self, seed: int) -> SampleSettings:
        """Return the settings that turn a mission into maps."""
        return SampleSettings(self.sensing, self.mapping, self.perturbation, self.parts, seed)

    def merge_by(self, method: str, as_published: bool) -> MergeSettings:
        """Return the settings of the merge by a method."""
        return replace(self.merge, method=method, as_published=as_published)

    def simulated_part(self) -> ExperimentConfig:
        """Keep what the simulation depends on; equal parts share a mission, of which shorter ones are cut."""
        team = replace(self.mission, robots=3, duration=120.0, beams=None, overlap=None, cut=CutSettings())
        return ExperimentConfig(world=self.world, mission=team)

    def observed_part(self) -> ExperimentConfig:
        """Keep what the true footprints depend on."""
        mapping = MappingSettings(clear_range=self.mapping.clear_range)
        return ExperimentConfig(world=self.world, mission=self.mission, mapping=mapping, parts=self.parts)

    def mapped_part(self) -> ExperimentConfig:
        """Keep what the maps depend on."""
        return replace(self, merge=MergeSettings())


def lidar_at_rate(name: str, rate: float | None) -> Lidar:
    """Return a preset's lidar, with fewer sweeps per second if ``rate`` [Hz] is given.

    Raises ``ValueError`` for an unknown preset, or a rate that it does not reach.
    """
    lidar = lidar_preset(name).lidar
    return lidar if rate is None else with_rate(lidar, rate)


def parse_perturbed_scales(text: str) -> tuple[float, float]:
    """Parse the true metres per stated metre of perturbed frames: hidden (0.5 to 2), honest (1), or LO:HI.

    Raises ``ValueError`` naming the value.
    """
    if text in ("hidden", "honest"):
        return (0.5, 2.0) if text == "hidden" else (1.0, 1.0)
    try:
        return parse_range(text)
    except ValueError:
        raise ValueError(f"scale is {text}, must be hidden, honest or LO:HI such as 0.8:1.25") from None


def max_yaw_of(max_rotation_deg: float) -> float:
    """Convert the greatest rotation of a frame to radians. Raises ``ValueError`` outside 0 to 180 degrees."""
    if not 0.0 <= max_rotation_deg <= 180.0:
        raise ValueError(f"max_rotation is {max_rotation_deg:g}, must lie between 0 and 180 degrees")
    return math.radians(max_rotation_deg)


def _perturbation_scale(config: ExperimentConfig, text: str) -> ExperimentConfig:
    low, high = parse_perturbed_scales(text)
    return replace(config, perturbation=replace(config.perturbation, scale_low=low, scale_high=high))


def _max_rotation(config: ExperimentConfig, text: str) -> ExperimentConfig:
    return replace(config, perturbation=replace(config.perturbation, max_yaw=max_yaw_of(parse_number(text))))


def _lidar_level(config: ExperimentConfig, text: str) -> ExperimentConfig:
    return _with_components(config, "lidar", dataclasses.asdict(RangeNoise().scaled(parse_number(text))))


def _odometry_level(config: ExperimentConfig, text: str) -> ExperimentConfig:
    return _with_components(config, "odometry", dataclasses.asdict(OdometryNoise().scaled(parse_number(text))))


def _adversity_level(config: ExperimentConfig, text: str) -> ExperimentConfig:
    scaled = LEVEL_ONE.scaled(parse_number(text))
    return _with_components(config, "adversity", {name: getattr(scaled, name) for name in AMOUNTS})


def _with_components(config: ExperimentConfig, part: str, values: Mapping[str, float]) -> ExperimentConfig:
    sensing = config.sensing
    for name, value in values.items():
        sensing = sensing.with_component(f"{part}.{name}", value)
    return replace(config, sensing=sensing)


COMBINED: Combined = MappingProxyType(
    {
        "perturbation.scale": _perturbation_scale,
        "perturbation.max_rotation": _max_rotation,
        "sensing.lidar.level": _lidar_level,
        "sensing.odometry.level": _odometry_level,
        "sensing.adversity.level": _adversity_level,
    }
)
"""Settings that set several leaves at once, or one in degrees: scales as hidden, honest or LO:HI; all components of the
lidar, or of the odometry, at a noise level of their own; the amounts of all adversities at a level."""
