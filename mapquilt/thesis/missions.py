"""Robots in the thesis's two worlds, and their maps: each mission is simulated once and sensed for every case."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mapping.grid import OccupancyGrid
from mapping.log_odds import map_log
from mapping.se2 import SE2, wrap_angle
from mapping.seeds import Role, stream
from mapping.sensor_model import sensor_model
from mapquilt.thesis.cases import FLOOR_MAPS, HALL_MAPS, RANGE_SIGMA, RESOLUTION, Place
from sim.lidar_presets import lidar_preset, with_rate
from sim.mission import Mission, simulate
from sim.mission_settings import MissionSettings
from sim.noise import Noise, sense
from sim.robot import RobotSettings
from worlds.families import make_world

LIDAR = "thesis"
RATE = 2.5
"""Sweeps a second [Hz]: at 0.6 m/s there is one every 0.24 m."""

CLEAR_RANGE = 4.9
"""Beams without a return clear so far [m]: the range that the thesis's mapper uses."""

HALL_DURATION, FLOOR_DURATION = 120.0, 120.0
START_JITTER = 0.3
"""Starts in the hall are moved by up to this either way [m], since exploring draws nothing at random."""


@dataclass(frozen=True, eq=False)
class DrawnMap:
    """A robot's map, and where its frame, the robot's start, lies in the world."""

    grid: OccupancyGrid
    world_from_map: SE2


def drawn_maps(place: Place, seed: int) -> dict[str, DrawnMap]:
    """The maps of a place by name, drawn at the true poses; a function of the seed alone."""
    return _hall_maps(seed) if place == "hall" else _floor_maps(seed)


def _hall_maps(seed: int) -> dict[str, DrawnMap]:
    """One robot a start, each alone in the hall."""
    world = make_world("thesis_hall", seed)
    rng = stream(seed, Role.STARTS)
    missions = {}
    for start in sorted({each.start for each in HALL_MAPS.values()}):
        x, y = rng.uniform(-START_JITTER, START_JITTER, 2)
        own = world.starts[start]
        missions[start] = _mission("thesis_hall", (SE2(own.x + x, own.y + y, own.yaw),), HALL_DURATION, seed)
    return {
        name: _drawn(missions[each.start], 0, each.resolution, each.range_sigma, seed, number)
        for number, (name, each) in enumerate(HALL_MAPS.items())
    }


def _floor_maps(seed: int) -> dict[str, DrawnMap]:
    """Three robots at once, each with a heading drawn from the seed: the thesis tells none."""
    yaws = stream(seed, Role.STARTS).uniform(-np.pi, np.pi, len(FLOOR_MAPS))
    own = make_world("thesis_floor", seed).starts
    starts = tuple(SE2(each.x, each.y, wrap_angle(float(yaw))) for each, yaw in zip(own, yaws, strict=True))
    mission = _mission("thesis_floor", starts, FLOOR_DURATION, seed)
    return {name: _drawn(mission, robot, RESOLUTION, RANGE_SIGMA, seed, robot) for robot, name in enumerate(FLOOR_MAPS)}


def _mission(world: str, starts: tuple[SE2, ...], duration: float, seed: int) -> Mission:
    lidar = with_rate(lidar_preset(LIDAR).lidar, RATE)
    robots = tuple(RobotSettings(lidar=lidar, start=start) for start in starts)
    return simulate(make_world(world, seed), MissionSettings(robots, duration), seed, clear_range=CLEAR_RANGE)[0]


def _drawn(mission: Mission, robot: int, resolution: float, range_sigma: float, seed: int, number: int) -> DrawnMap:
    noise = replace(lidar_preset(LIDAR).noise, range_sigma=range_sigma)
    truth = mission.robots[robot]
    sensed = sense(truth, Noise(noise), seed, number)
    grid = map_log(sensed.log, truth.trajectory.from_start(), resolution, sensor_model("octomap"), CLEAR_RANGE)
    return DrawnMap(grid, truth.trajectory.pose(0))
