"""Missions in the two worlds of the thesis: each is simulated once and sensed for every case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.se2 import SE2, wrap_angle
from mapping.grid.log_odds import map_log
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.sensor_model import sensor_model
from mapping.seeds import Role, stream
from reproductions.chen2021.cases import FLOOR_MAPS, HALL_MAPS, RANGE_SIGMA, RESOLUTION, Place
from sim.mission.mission import Mission
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.physics.robot import RobotSettings
from sim.sensors.lidar_presets import lidar_preset, with_rate
from sim.sensors.noise import Noise
from sim.sensors.sensing import sense
from worlds.building.floor_plan import Room
from worlds.families.registry import make_world
from worlds.families.thesis_floor import thesis_floor_plan
from worlds.world import World

Goals = tuple[tuple[float, float], ...]
"""Goals x, y [m] in the order of the visit."""

LIDAR = "thesis"
RATE = 2.5
"""Scan rate [Hz]: at 0.6 m/s, one scan every 0.24 m."""

CLEAR_RANGE = 4.9
"""Range cleared by beams without a return [m], as in the mapper of the thesis."""

HALL_DURATION, FLOOR_DURATION = 120.0, 170.0
START_JITTER = 0.3
"""Greatest random shift of a start in the hall in x and y [m]; exploration itself is deterministic."""


@dataclass(frozen=True, eq=False)
class DrawnMap:
    """A robot's map, and the pose of its frame, the robot's start, in the world."""

    grid: OccupancyGrid
    world_from_map: SE2


def drawn_maps(place: Place, seed: int) -> dict[str, DrawnMap]:
    """Build the maps of a place by name, at true poses; they depend on the seed alone."""
    return _hall_maps(seed) if place == "hall" else _floor_maps(seed)


def _hall_maps(seed: int) -> dict[str, DrawnMap]:
    """Build one map per start, each by a single robot in the hall."""
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
    """Build one map per wing; the seed draws the start headings, which the thesis does not give."""
    world = make_world("thesis_floor", seed)
    yaws = stream(seed, Role.STARTS).uniform(-np.pi, np.pi, len(FLOOR_MAPS))
    maps = {}
    for robot, (name, goals) in enumerate(zip(FLOOR_MAPS, _rounds(world, seed), strict=True)):
        own = world.starts[robot]
        start = SE2(own.x, own.y, wrap_angle(float(yaws[robot])))
        mission = _mission("thesis_floor", (start,), FLOOR_DURATION, seed, goals)
        maps[name] = _drawn(mission, 0, RESOLUTION, RANGE_SIGMA, seed, robot)
    return maps


def _rounds(world: World, seed: int) -> tuple[Goals, Goals, Goals]:
    """List the rooms that each robot visits: a side wing and the first room of the lower wing; and the lower wing with
    the first room of either side. So the map of robot 3 overlaps both others, which hardly overlap each other."""
    plan = thesis_floor_plan(stream(seed, Role.WORLD), *world.size)
    corridor = plan.rooms[0]
    rooms = [room for room in plan.rooms if room.kind == "room"]
    low = [room for room in rooms if room.y0 < corridor.y0]
    left = [room for room in rooms if room not in low and room.x1 < world.size[0] / 2.0]
    right = [room for room in rooms if room not in low and room not in left]
    return (
        _middles([*left[::-1], low[0]]),
        _middles([*right[::-1], low[-1]]),
        _middles([left[0], *low[::3], right[0]]),
    )


def _middles(rooms: Sequence[Room]) -> Goals:
    return tuple(((room.x0 + room.x1) / 2.0, (room.y0 + room.y1) / 2.0) for room in rooms)


def _mission(world: str, starts: tuple[SE2, ...], duration: float, seed: int, goals: Goals = ()) -> Mission:
    lidar = with_rate(lidar_preset(LIDAR).lidar, RATE)
    robots = tuple(RobotSettings(lidar=lidar, start=start) for start in starts)
    settings = MissionSettings(robots, duration, policy="patrol" if goals else "explore", goals=goals)
    return simulate(make_world(world, seed), settings, seed)[0]


def _drawn(mission: Mission, robot: int, resolution: float, range_sigma: float, seed: int, number: int) -> DrawnMap:
    noise = replace(lidar_preset(LIDAR).noise, range_sigma=range_sigma)
    truth = mission.robots[robot]
    sensed = sense(truth, Noise(noise), seed, number)
    grid = map_log(sensed.log, truth.trajectory.from_start(), resolution, sensor_model("octomap"), CLEAR_RANGE)
    return DrawnMap(grid, truth.trajectory.pose(0))
