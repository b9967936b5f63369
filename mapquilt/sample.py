"""From a clean mission to a team's maps and their truth: sense, map, disguise, fit."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from mapping.believed import by_odometry
from mapping.disguise import DisguiseRanges, disguise, draw_disguises
from mapping.grid import OccupancyGrid
from mapping.log_odds import map_log
from mapping.map_set import MapSet
from mapping.robot_log import RobotLog, RobotTruth
from mapping.sensor_model import sensor_model
from mapping.similarity2 import Similarity2
from mapping.trajectory import Trajectory
from mapping.truth import (
    TRUE_RESOLUTION,
    MapTruth,
    PairTruth,
    Sightings,
    footprint,
    map_truth,
    observed,
    pair_truth,
    sightings,
)
from mapquilt.truth_file import RobotOrigin, RunTruth
from sim.mission import Mission
from sim.noise import Noise, Sensed, sense
from worlds.raster import true_raster

Poses = Literal["odometry", "truth"]


SCALES = {"hidden": (0.5, 2.0), "honest": (1.0, 1.0)}


def disguise_ranges(scale: str, max_rotation_deg: float, max_offset: float) -> DisguiseRanges:
    """What disguises are drawn from; ``scale`` is hidden (0.5 to 2), honest (1) or LO:HI.

    Raises ``ValueError`` naming the setting and the value.
    """
    low, _, high = scale.partition(":")
    try:
        bounds = SCALES[scale] if scale in SCALES else (float(low), float(high))
    except ValueError:
        raise ValueError(f"scale is {scale!r}, must be hidden, honest or LO:HI such as 0.8:1.25") from None
    if not 0.0 <= max_rotation_deg <= 180.0:
        raise ValueError(f"max-rotation is {max_rotation_deg} degrees, must lie between 0 and 180")
    return DisguiseRanges(*bounds, math.radians(max_rotation_deg), max_offset)


@dataclass(frozen=True)
class SampleSettings:
    """How maps are made of a mission: noise level, the poses that robots map with, what the disguise is drawn from,
    resolution [m/cell], inverse sensor model, how far beams without a return clear [m], and the seed of noise and
    disguise.

    Raises ``ValueError`` naming the field and the value.
    """

    noise: float = 1.0
    poses: Poses = "odometry"
    disguise: DisguiseRanges = field(default_factory=DisguiseRanges)
    resolution: float = 0.05
    model: str = "octomap"
    clear_range: float = 0.0
    seed: int = 7

    def __post_init__(self) -> None:
        Noise.level(self.noise)
        sensor_model(self.model)
        if self.poses not in ("odometry", "truth"):
            raise ValueError(f"poses is {self.poses!r}, must be odometry or truth")
        if not 0.001 <= self.resolution <= 10.0:
            raise ValueError(f"resolution is {self.resolution} m, must lie between 0.001 and 10")
        if not 0.0 <= self.clear_range < math.inf:
            raise ValueError(f"clear_range is {self.clear_range} m, must be finite and not negative")
        if self.seed < 0:
            raise ValueError(f"seed is {self.seed}, must not be negative")


@dataclass(frozen=True, eq=False)
class Sample:
    """A team's maps as the merger gets them, the logs they were drawn from, and the truth: transforms, the world's
    true raster, and the part of it that each robot could have seen."""

    maps: MapSet
    logs: tuple[RobotLog, ...]
    truth: RunTruth
    world: OccupancyGrid
    footprints: tuple[OccupancyGrid, ...]


@dataclass(frozen=True, eq=False)
class _RobotSample:
    log: RobotLog
    grid: OccupancyGrid
    start_from_map: Similarity2
    seen: Sightings
    footprint: OccupancyGrid
    truth: MapTruth


def make_sample(mission: Mission, settings: SampleSettings, on_robot: Callable[[], None] = lambda: None) -> Sample:
    """Sense, map and disguise a mission once; the same settings give the same sample.

    ``on_robot`` is called as each robot is done. Raises ``ValueError`` where a robot saw nothing to map.
    """
    world = true_raster(mission.world, TRUE_RESOLUTION)
    robots = []
    for index, start_from_map in enumerate(draw_disguises(settings.seed, len(mission.robots), settings.disguise)):
        robots.append(_make_robot(mission.robots[index], index, settings, start_from_map, world))
        on_robot()
    names = tuple(f"robot_{index}" for index in range(len(robots)))
    return Sample(
        maps=MapSet(
            names=names,
            grids=tuple(robot.grid for robot in robots),
            units=tuple("m" for _ in robots),
            resolutions_trusted=settings.disguise.honest,
            provenance={"source": "simulation", "world": mission.world.name},
        ),
        logs=tuple(robot.log for robot in robots),
        truth=RunTruth(_origins(names, robots, mission), _pair_truths(names, robots)),
        world=world,
        footprints=tuple(robot.footprint for robot in robots),
    )


def _make_robot(
    truth: RobotTruth, index: int, settings: SampleSettings, start_from_map: Similarity2, world: OccupancyGrid
) -> _RobotSample:
    sensed = sense(truth, Noise.level(settings.noise), settings.seed, index)
    believed = _believed(sensed, truth, settings.poses)
    drawn = map_log(sensed.log, believed, settings.resolution, sensor_model(settings.model), settings.clear_range)
    seen = sightings(sensed.log, truth, believed, sensed.replaced)
    return _RobotSample(
        log=sensed.log,
        grid=disguise(drawn, start_from_map),
        start_from_map=start_from_map,
        seen=seen,
        footprint=footprint(world, observed(truth, world.frame, settings.clear_range)),
        truth=map_truth(seen, truth.trajectory.pose(0), start_from_map),
    )


def _believed(sensed: Sensed, truth: RobotTruth, poses: Poses) -> Trajectory:
    return by_odometry(sensed.log) if poses == "odometry" else truth.trajectory.from_start()


def _origins(names: tuple[str, ...], robots: list[_RobotSample], mission: Mission) -> tuple[RobotOrigin, ...]:
    return tuple(
        RobotOrigin(name, truth.trajectory.pose(0), robot.start_from_map, robot.truth)
        for name, robot, truth in zip(names, robots, mission.robots, strict=True)
    )


def _pair_truths(names: tuple[str, ...], robots: list[_RobotSample]) -> dict[tuple[str, str], PairTruth]:
    pairs = {}
    for t, s in itertools.combinations(range(len(robots)), 2):
        target, source = robots[t], robots[s]
        pairs[names[t], names[s]] = pair_truth(
            target.seen,
            source.seen,
            target.start_from_map,
            source.start_from_map,
            target.footprint,
            source.footprint,
        )
    return pairs
