"""Draw what is adverse in a world, and change the scans of robots by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.robot.robot_log import RobotTruth
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory
from sim.sensors.adversity.doorways import find_doorways
from sim.sensors.adversity.free_floor import free_floor
from sim.sensors.adversity.glass import GlassWalls, glaze, see_through
from sim.sensors.adversity.movables import Movables, move_things
from sim.sensors.adversity.people import People, walk
from sim.sensors.adversity.ramps import Ramps, build_ramps, tilted_ranges
from sim.sensors.adversity.ray_casting import cast_on_discs, cast_on_segments
from sim.sensors.adversity.settings import STEP, Adversity
from sim.sensors.range_noise import within_limits
from worlds.world import World


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Hold what is adverse in a world during a mission. All robots of a team share it."""

    people: People
    movables: Movables
    glass: GlassWalls
    ramps: Ramps
    adversity: Adversity


def draw_surroundings(
    world: World, paths: Sequence[Trajectory], adversity: Adversity, seed: int
) -> Surroundings | None:
    """Draw the people, doors, objects, glass and ramps of a mission; None if the adversity has none.

    ``paths`` are world_from_base of all robots, which people, doors and objects make way for. Each kind has random
    streams of its own.
    """
    if not adversity.in_world:
        return None
    floor, robots = free_floor(world, paths, adversity.person_radius), _places(paths)
    doorways = find_doorways(world) if adversity.doors > 0.0 else np.empty((0, 2, 2))
    return Surroundings(
        people=walk(floor, robots, adversity, seed),
        movables=move_things(doorways, floor, robots, adversity, seed),
        glass=glaze(world, adversity, seed),
        ramps=build_ramps(floor, adversity, seed),
        adversity=adversity,
    )


def _places(paths: Sequence[Trajectory]) -> NDArray[np.float64]:
    """Return the places (T, R, 2) [m] of the robots every ``STEP``, up to the end of the longest path."""
    times = np.arange(0.0, max(path.stamps[-1] for path in paths) + 2.0 * STEP, STEP)
    return np.stack(
        [np.stack([np.interp(times, path.stamps, path.poses[:, k]) for k in (0, 1)], axis=-1) for path in paths], axis=1
    )


def adverse_scans(truth: RobotTruth, around: Surroundings) -> tuple[tuple[LidarScan, ...], NDArray[np.bool_]]:
    """Return the scans of a robot with everything adverse in the world, and a mask (N, B) of the changed readings.

    Beams first pass glass, then end on people, doors and objects, and then, if the lidar is tilted, on the floor. The
    mask marks readings that do not come from the surface that the true beam hits. That a tilted beam is longer by
    1 / cos does not count.
    """
    changed, scans = np.empty(truth.hits_robot.shape, dtype=np.bool_), []
    for k, scan in enumerate(truth.scans):
        lidar = truth.trajectory.pose(k) @ truth.base_from_lidar
        origin, angles = np.array((lidar.x, lidar.y)), scan.angles + lidar.yaw
        directions = np.stack((np.cos(angles), np.sin(angles)), axis=-1)
        level = _level_ranges(around, scan, origin, directions, truth.hits_robot[k])
        tilted, on_floor = _tilted(around, truth.trajectory.poses[k, :2], angles, level)
        scans.append(within_limits(scan, tilted))
        changed[k] = ((level != scan.ranges) | on_floor) & (scans[k].ranges != scan.ranges)
    return tuple(scans), changed


def _level_ranges(
    around: Surroundings,
    scan: LidarScan,
    origin: NDArray[np.float64],
    directions: NDArray[np.float64],
    hits_robot: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """Return the ranges (B,) of a level lidar. Beams that hit another robot pass no glass."""
    true = scan.ranges.astype(np.float64)
    through = np.where(hits_robot, true, see_through(around.glass, origin, directions, true))
    on_people = cast_on_discs(origin, directions, around.people.at(scan.stamp), around.people.radius)
    on_things = cast_on_segments(origin, directions, around.movables.at(scan.stamp))
    return np.asarray(np.minimum(np.minimum(on_people, on_things), through))


def _tilted(
    around: Surroundings, place: NDArray[np.float64], angles: NDArray[np.float64], ranges: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the ranges (B,) of the lidar at a place (2,), tilted if it is a ramp, and which beams hit the floor."""
    uphill = around.ramps.uphill_at(place)
    if uphill is None:
        return ranges, np.zeros(len(ranges), dtype=np.bool_)
    return tilted_ranges(ranges, angles - uphill, around.adversity.ramp_slope, around.adversity.lidar_height)
