"""Robots stay inside a fence that their lidars do not see."""

from __future__ import annotations

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.trajectory import Trajectory
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.navigation.fence import Fence
from sim.physics.robot import RobotSettings
from sim.policies.patrol import draw_goals
from worlds.polygon import box, disc
from worlds.world import World

TREES = tuple(disc(x, y, 0.3, 12) for x in (2.0, 7.0, 12.0) for y in (2.0, 7.0, 12.0))
PARK = World("park", 0, (14.0, 14.0), TREES, fence=box(3.0, 3.0, 11.0, 10.0))


@pytest.mark.slow
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
    assert mission.contacts == (0, 0)


@pytest.mark.slow
def test_a_patrolling_team_stays_inside_and_reaches_goals_on_both_sides() -> None:
    goals = [(3.6, 4.0), (10.4, 9.0)]
    mission, _ = simulate(PARK, MissionSettings(2, 30.0, policy="patrol", goals=goals), 1)
    places = np.concatenate([robot.trajectory.poses[:, :2] for robot in mission.robots])
    assert PARK.clearance(places).min() >= 0.2
    assert mission.contacts == (0, 0)
    for goal in goals:
        assert np.hypot(*(places - goal).T).min() < 0.4


def test_drawn_goals_lie_inside() -> None:
    for seed in range(5):
        drawn = draw_goals(np.random.default_rng(seed), PARK, SE2(5.0, 5.0), 0.2)
        assert PARK.clearance(drawn).min() >= 0.3 - 1e-9


@pytest.mark.parametrize(
    ("goal", "message"),
    [
        ((12.5, 5.0), r"goal 0 at \(12.5, 5\) is outside the fence of world 'park'"),
        ((3.1, 5.0), r"goal 0 at \(3.1, 5\) is 0.10 m from a solid or the fence of world 'park'"),
        ((7.0, 7.0), r"goal 0 at \(7, 7\) is in a wall of world 'park'"),
    ],
)
def test_goals_outside_are_refused(goal: tuple[float, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        simulate(PARK, MissionSettings(1, 1.0, policy="patrol", goals=[goal]), 1)


@pytest.mark.parametrize(
    ("start", "message"),
    [
        (SE2(12.5, 5.0), r"start 0 at \(12.5, 5\) is outside the fence of world 'park'"),
        (SE2(3.1, 5.0), r"start 0 at \(3.1, 5\) is 0.10 m from a solid or the fence of world 'park'"),
    ],
)
def test_starts_outside_are_refused(start: SE2, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        simulate(PARK, MissionSettings([RobotSettings(start=start)], 1.0), 1)


def test_a_replay_that_leaves_the_fence_is_refused_and_one_inside_is_driven() -> None:
    settings = MissionSettings(1, 2.0, policy="replay")
    inside = Trajectory(np.array((0.0, 2.0)), np.array(((4.0, 4.0, 0.0), (4.0, 8.0, 0.0))))
    mission, _ = simulate(PARK, settings, 0, replay=[inside])
    assert mission.robots[0].trajectory.poses[-1] == pytest.approx((4.0, 8.0, 0.0))
    leaving = Trajectory(np.array((0.0, 2.0)), np.array(((10.0, 4.0, 0.0), (12.0, 4.0, 0.0))))
    with pytest.raises(ValueError, match=r"robot_0: at 2 s, \(12, 4\), it is outside the fence of world 'park'"):
        simulate(PARK, settings, 0, replay=[leaving])


def test_the_fence_is_a_wall_for_plans_and_for_steering() -> None:
    fence = Fence(box(1.0, 1.0, 3.0, 2.0))
    grid = OccupancyGrid(GridFrame(0.1, SE2(0.5, 0.0, 0.0), (15, 20)), np.full((15, 20), -1.0))
    drawn = fence.add_to_grid(grid)
    assert drawn.occupied[10, 5:].all()
    assert drawn.occupied[10:, 5].all()
    assert drawn.occupied.sum() == 20 - 5 + 15 - 10 - 1
    seen = fence.add_to_points(np.array([(9.0, 9.0)]), SE2(2.0, 1.5, np.pi / 2.0))
    assert seen[0].tolist() == [9.0, 9.0]
    ahead, left = np.abs(seen[1:]).max(axis=0)
    assert (ahead, left) == (pytest.approx(0.5), pytest.approx(1.0))


def test_without_a_fence_nothing_changes() -> None:
    grid = OccupancyGrid(GridFrame(0.1, SE2.identity(), (3, 3)), np.zeros((3, 3)))
    seen = np.array([(1.0, 2.0)])
    assert Fence(None).add_to_grid(grid) is grid
    assert Fence(None).add_to_points(seen, SE2.identity()) is seen
