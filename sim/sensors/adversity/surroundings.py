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
    return Surroundings(
        people=walk(floor, robots, adversity, seed),
        movables=move_things(find_doorways(world), floor, robots, adversity, seed),
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
    lidars = [truth.trajectory.pose(k) @ truth.base_from_lidar for k in range(len(truth.scans))]
    angles = np.stack([scan.angles + lidar.yaw for scan, lidar in zip(truth.scans, lidars, strict=True)])
    directions = np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    origins = np.array([(lidar.x, lidar.y) for lidar in lidars])
    true = np.stack([scan.ranges for scan in truth.scans])
    ranges = _through_glass(around.glass, origins, directions, true.astype(np.float64), truth.hits_robot)
    changed, scans = np.empty(true.shape, dtype=np.bool_), []
    for k, scan in enumerate(truth.scans):
        on_people = cast_on_discs(origins[k], directions[k], around.people.at(scan.stamp), around.people.radius)
        on_things = cast_on_segments(origins[k], directions[k], around.movables.at(scan.stamp))
        level = np.minimum(np.minimum(on_people, on_things), ranges[k])
        tilted, on_floor = _tilted(around, truth.trajectory.poses[k, :2], angles[k], level)
        scans.append(within_limits(scan, tilted))
        changed[k] = ((level != true[k]) | on_floor) & (scans[k].ranges != true[k])
    return tuple(scans), changed


def _through_glass(
    glass: GlassWalls,
    origins: NDArray[np.float64],
    directions: NDArray[np.float64],
    true: NDArray[np.float64],
    hits_robot: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """Return the ranges (N, B) past the glass; beams that hit another robot hit no pane."""
    if not len(glass.panes):
        return true
    solid = np.where(hits_robot, np.inf, true).ravel()
    starts = np.repeat(origins, true.shape[1], axis=0)
    seen = see_through(glass, starts, directions.reshape(-1, 2), solid).reshape(true.shape)
    return np.where(hits_robot, true, seen)


def _tilted(
    around: Surroundings, place: NDArray[np.float64], angles: NDArray[np.float64], ranges: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the ranges (B,) of the lidar at a place (2,), tilted if it is a ramp, and which beams hit the floor."""
    uphill = around.ramps.uphill_at(place)
    if uphill is None:
        return ranges, np.zeros(len(ranges), dtype=np.bool_)
    return tilted_ranges(ranges, angles - uphill, around.adversity.ramp_slope, around.adversity.lidar_height)
