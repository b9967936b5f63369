"""One mission for all levels: shorter times, smaller teams and fewer beams are cut out of it."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from mapping.ground_truth.footprint import TRUE_RESOLUTION
from mapping.robot.robot_log import RobotTruth
from mapping.robot.scan import LidarScan
from mapquilt.jobs.mission_cache import MissionCache
from mapquilt.runs.open_world import open_world
from mapquilt.settings import ExperimentConfig
from sim.mission.mission import Mission
from sim.mission.overlap import cut_to_overlap
from sim.mission.simulation import simulate
from sim.sensors.lidar import Lidar
from worlds.raster import true_raster


def largest_mission(world: str, seed: int, setups: Sequence[ExperimentConfig], cache: Path | None) -> Mission:
    """Simulate the mission with the most robots and the longest time of these setups, which share their drive.

    Raises ``ValueError`` if the robots do not fit into the world.
    """
    first = setups[0]
    robots, duration = max(setup.mission.robots for setup in setups), max(setup.mission.duration for setup in setups)
    settings = replace(first.mission, robots=robots, duration=duration, overlap=None, beams=None).mission()
    place, _ = open_world(first.world.family or world, seed, first.world.width, first.world.height)
    if cache is None:
        return simulate(place, settings, seed)[0]
    kept = MissionCache(cache).mission(place, settings, seed)
    if kept.warning is not None:
        warnings.warn(kept.warning, stacklevel=2)
    return kept.mission


def cut_mission(mission: Mission, setup: ExperimentConfig) -> Mission:
    """Keep the first robots, the duration and the beams of a setup, and end robots where they reach its overlap.

    If no ends reach the overlap, the nearest are taken.
    """
    robots = mission.settings.robots[: setup.mission.robots]
    kept = _with_robots(mission, mission.robots[: setup.mission.robots], setup)
    kept = kept.cut([robot.scans(setup.mission.duration) for robot in robots])
    if setup.mission.overlap is None:
        return kept
    frame = true_raster(mission.world, TRUE_RESOLUTION).frame
    overlap, clear_range = setup.mission.overlap, setup.mapping.clear_range
    return kept.cut(cut_to_overlap(kept.robots, frame, overlap, clear_range, setup.mission.cut).scans)


def _with_robots(mission: Mission, truths: Sequence[RobotTruth], setup: ExperimentConfig) -> Mission:
    settings = mission.settings
    robots = settings.robots[: len(truths)]
    if setup.mission.beams is not None:
        truths = [
            _thinned(truth, robot.lidar, setup.mission.beams) for truth, robot in zip(truths, robots, strict=True)
        ]
        robots = tuple(replace(robot, lidar=_lidar(robot.lidar, setup.mission.beams)) for robot in robots)
    smaller = replace(settings, robots=robots, duration=setup.mission.duration, overlap=setup.mission.overlap)
    return Mission(mission.world, tuple(truths), mission.seed, smaller, mission.contacts[: len(truths)])


def _lidar(lidar: Lidar, beams: int) -> Lidar:
    return replace(lidar, beams=beams, angle_increment=lidar.angle_increment * (lidar.beams // beams))


def _thinned(truth: RobotTruth, lidar: Lidar, beams: int) -> RobotTruth:
    step, fewer = lidar.beams // beams, _lidar(lidar, beams)
    scans = tuple(
        LidarScan(
            scan.stamp, fewer.angle_min, fewer.angle_increment, fewer.range_min, fewer.range_max, scan.ranges[::step]
        )
        for scan in truth.scans
    )
    return RobotTruth(scans, truth.trajectory, truth.hits_robot[:, ::step], truth.base_from_lidar)
