"""Patrols and replays, which depend on the seed alone."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.robot.trajectory import Trajectory
from sim.mission.controllers import make_patrols
from sim.mission.file import load_mission, save_mission
from sim.mission.mission import Mission
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.physics.robot import RobotSettings
from tests.sim.mission.test_mission import digests
from worlds.families.registry import make_world
from worlds.world import World


@pytest.mark.slow
def test_a_patrol_visits_goals_in_turn_from_different_first_goals(two_rooms: World) -> None:
    goals = [(1.0, 4.0), (7.0, 4.0)]
    team = [RobotSettings(start=SE2(1.0, 1.0)), RobotSettings(start=SE2(7.2, 2.5))]
    mission, _ = simulate(two_rooms, MissionSettings(team, 45.0, policy="patrol", goals=goals), 1)
    assert mission.contacts == (0, 0)
    for rank, truth in enumerate(mission.robots):
        away = [np.hypot(*(truth.trajectory.poses[:, :2] - goal).T) < 0.35 for goal in goals]
        first = [int(np.argmax(each)) if each.any() else -1 for each in away]
        assert min(first) >= 0
        assert first[rank] < first[1 - rank]


def test_each_robot_draws_its_own_goals() -> None:
    world, starts = make_world("open_hall", 1), [SE2(8.0, 8.0)] * 3
    patrols = make_patrols(world, MissionSettings(3, 1.0, policy="patrol"), starts, seed=1)
    assert len({patrol.goals for patrol in patrols}) == 3
    assert len({goal for patrol in patrols for goal in patrol.goals}) > 20


@pytest.mark.slow
def test_robots_that_start_together_explore_apart() -> None:
    mission, _ = simulate(make_world("open_hall", 2), MissionSettings(4, 8.0, starts="close"), 2)
    ways = np.array([robot.trajectory.poses[-1, :2] - robot.trajectory.poses[0, :2] for robot in mission.robots])
    directions = ways / np.hypot(*ways.T)[:, None]
    assert np.hypot(*ways.T).min() > 1.0
    assert np.hypot(*directions.mean(axis=0)) < 0.5


@pytest.mark.slow
def test_drawn_goals_depend_on_the_seed() -> None:
    world = make_world("house", 1)
    settings = MissionSettings(2, 15.0, policy="patrol")
    one, again, other = (simulate(world, settings, seed)[0].robots[0].trajectory for seed in (1, 1, 2))
    assert np.array_equal(one.poses, again.poses)
    assert one.distance() > 4.0
    assert not np.array_equal(one.poses, other.poses)


@pytest.mark.parametrize(
    ("goal", "message"),
    [
        ((4.1, 1.0), r"goal 1 at \(4.1, 1\) is in a wall of world 'two rooms'"),
        ((1.0, 0.35), r"goal 1 at \(1, 0.35\) is 0.15 m from a wall"),
        ((1.0, -2.0), r"goal 1 at \(1, -2\) is outside world 'two rooms'"),
    ],
)
def test_bad_goals_are_refused_with_what_and_where(two_rooms: World, goal: tuple[float, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        simulate(two_rooms, MissionSettings(1, 1.0, policy="patrol", goals=[(1.0, 1.0), goal]), 0)


def test_a_goal_behind_a_wall_without_a_door_is_refused() -> None:
    world = make_world("disjoint", 1)
    start = simulate(world, MissionSettings(4, 0.1), 1)[0].robots[0].trajectory.pose(0)
    there = simulate(world, MissionSettings(4, 0.1), 1)[0].robots[1].trajectory.pose(0)
    team = [RobotSettings(start=start)]
    with pytest.raises(ValueError, match="that no robot starts in"):
        simulate(world, MissionSettings(team, 1.0, policy="patrol", goals=[(there.x, there.y)]), 0)


def test_a_replayed_mission_has_the_scans_of_the_original(mission: Mission) -> None:
    paths = tuple(truth.trajectory for truth in mission.robots)
    settings = MissionSettings(mission.settings.robots, mission.settings.duration, policy="replay")
    again, _ = simulate(mission.world, settings, 0, replay=paths)
    for a, b in zip(mission.robots, again.robots, strict=True):
        assert np.allclose(a.trajectory.poses[:, :2], b.trajectory.poses[:, :2], atol=1e-9)
        assert np.abs(np.sin((a.trajectory.poses - b.trajectory.poses)[:, 2])).max() < 1e-9
        for one, two in zip(a.scans, b.scans, strict=True):
            both = one.returned & two.returned
            assert (both == one.returned).mean() > 0.99
            assert np.quantile(np.abs(one.ranges[both] - two.ranges[both]), 0.99) < 1e-3
        assert (a.hits_robot == b.hits_robot).mean() > 0.999


def test_a_replay_interpolates_the_shorter_way_and_stops_at_its_end(two_rooms: World) -> None:
    path = Trajectory(np.array((5.0, 6.0)), np.array(((1.0, 1.0, math.pi - 0.1), (2.0, 1.0, -math.pi + 0.1))))
    mission, _ = simulate(two_rooms, MissionSettings(1, 2.0, policy="replay"), 0, replay=[path])
    poses = mission.robots[0].trajectory.poses
    assert poses[5] == pytest.approx((1.5, 1.0, math.pi)) or poses[5] == pytest.approx((1.5, 1.0, -math.pi))
    assert poses[-1] == pytest.approx((2.0, 1.0, -math.pi + 0.1))


def test_a_replay_of_one_pose_stands_still(two_rooms: World) -> None:
    path = Trajectory(np.array((5.0,)), np.array(((1.0, 1.0, 0.5),)))
    mission, _ = simulate(two_rooms, MissionSettings(1, 1.0, policy="replay"), 0, replay=[path])
    assert mission.robots[0].trajectory.poses == pytest.approx(np.tile((1.0, 1.0, 0.5), (11, 1)))


def test_a_replay_through_a_wall_is_refused_with_when_and_where(two_rooms: World) -> None:
    path = Trajectory(np.arange(3.0), np.array(((3.0, 1.0, 0.0), (4.1, 1.0, 0.0), (5.0, 1.0, 0.0))))
    settings = MissionSettings(1, 2.0, policy="replay")
    with pytest.raises(ValueError, match=r"replay of robot_0: at 1 s, \(4.1, 1\), it is in a wall"):
        simulate(two_rooms, settings, 0, replay=[path])
    leap = Trajectory(np.arange(2.0), np.array(((3.0, 1.0, 0.0), (5.0, 1.0, 0.0))))
    with pytest.raises(ValueError, match=r"replay of robot_0: at 0.5 s, \(4, 1\), it is in a wall"):
        simulate(two_rooms, settings, 0, replay=[leap])
    with pytest.raises(ValueError, match="replay holds 1 trajectories, must hold one for each of 2 robots"):
        simulate(two_rooms, MissionSettings(2, 2.0, policy="replay"), 0, replay=[path])
    with pytest.raises(ValueError, match="replay holds 0 trajectories, but the policy is replay"):
        simulate(two_rooms, settings, 0)


@pytest.mark.slow
def test_a_patrolling_team_on_wheels_gives_the_same_bytes_in_another_process(tmp_path: Path) -> None:
    program = """
import sys
from pathlib import Path
from sim.mission.simulation import simulate
from sim.mission.file import save_mission
from sim.mission.settings import MissionSettings
from worlds.families.registry import make_world
settings = MissionSettings(3, 6.0, starts="close", drive="wheels", policy="patrol")
save_mission(simulate(make_world("house", 3), settings, seed=5)[0], Path(sys.argv[1]))
"""
    subprocess.run([sys.executable, "-c", program, str(tmp_path / "other")], check=True, capture_output=True)
    settings = MissionSettings(3, 6.0, starts="close", drive="wheels", policy="patrol")
    mission, _ = simulate(make_world("house", 3), settings, seed=5)
    save_mission(mission, tmp_path / "here")
    assert digests(tmp_path / "here") == digests(tmp_path / "other")
    assert load_mission(tmp_path / "here").settings == settings
