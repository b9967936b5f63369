"""Robots keep inside a fence that their lidars look through."""

from __future__ import annotations

import numpy as np
import pytest

from mapping.frame import GridFrame
from mapping.grid import OccupancyGrid
from mapping.se2 import SE2
from sim.fence import Fence
from sim.mission import MissionSettings, simulate
from worlds.polygon import box, disc
from worlds.world import World

TREES = tuple(disc(x, y, 0.3, 12) for x in (2.0, 7.0, 12.0) for y in (2.0, 7.0, 12.0))
PARK = World("park", 0, (14.0, 14.0), TREES, fence=box(3.0, 3.0, 11.0, 10.0))


def test_no_robot_leaves_the_fence_and_the_lidar_sees_trees_beyond() -> None:
    mission, _ = simulate(PARK, MissionSettings(robots=2, duration=25.0), 1)
    for robot in mission.robots:
        places = robot.trajectory.poses[:, :2]
        assert PARK.clearance(places).min() >= 0.2
        assert np.ptp(places, axis=0).max() > 2.0
        hits = [
            (SE2(*pose) @ robot.base_from_lidar).apply(scan.points())
            for pose, scan in zip(robot.trajectory.poses, robot.scans, strict=True)
        ]
        assert (np.concatenate(hits)[:, 0] > 11.5).any()
    assert mission.touches == (0, 0)


def test_the_fence_is_a_wall_for_plans_and_for_steering() -> None:
    fence = Fence(box(1.0, 1.0, 3.0, 2.0))
    grid = OccupancyGrid(GridFrame(0.1, SE2(0.5, 0.0, 0.0), (15, 20)), np.full((15, 20), -1.0))
    drawn = fence.drawn_into(grid)
    assert drawn.occupied[10, 5:].all()
    assert drawn.occupied[10:, 5].all()
    assert drawn.occupied.sum() == 20 - 5 + 15 - 10 - 1
    seen = fence.beside(np.array([(9.0, 9.0)]), SE2(2.0, 1.5, np.pi / 2.0))
    assert seen[0].tolist() == [9.0, 9.0]
    ahead, left = np.abs(seen[1:]).max(axis=0)
    assert (ahead, left) == (pytest.approx(0.5), pytest.approx(1.0))


def test_without_a_fence_nothing_changes() -> None:
    grid = OccupancyGrid(GridFrame(0.1, SE2.identity(), (3, 3)), np.zeros((3, 3)))
    seen = np.array([(1.0, 2.0)])
    assert Fence(None).drawn_into(grid) is grid
    assert Fence(None).beside(seen, SE2.identity()) is seen
