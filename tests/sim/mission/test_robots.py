"""Robots with settings of their own, on both drives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.physics.bullet import BulletScene
from sim.physics.drive import Drive, DriveLimits
from sim.physics.robot import RobotSettings
from sim.sensors.lidar import Lidar
from worlds.families.registry import make_world
from worlds.world import World

NOTHING = World("nothing", 0, (90, 90), ())
SLOW = RobotSettings(Lidar(beams=90, angle_increment=math.tau / 90, rate=4.0), DriveLimits(speed=0.3, turn_rate=0.7))


def test_a_number_makes_equal_robots() -> None:
    assert MissionSettings(3) == MissionSettings((RobotSettings(),) * 3)
    assert MissionSettings(3) != MissionSettings(2)


@pytest.mark.parametrize("drive", ["velocity", "wheels"])
def test_each_robot_has_its_lidar_its_limits_and_its_start(drive: Drive) -> None:
    world = make_world("office", 1)
    place = simulate(world, MissionSettings(1, 0.1), 1)[0].robots[0].trajectory.pose(0)
    team = (replace(SLOW, start=place), RobotSettings())
    mission, _ = simulate(world, MissionSettings(team, 8.0, drive=drive), 1)
    slow, usual = mission.robots
    assert slow.trajectory.stamps.tolist() == [k / 4.0 for k in range(33)]
    assert usual.trajectory.stamps.tolist() == [k / 10.0 for k in range(81)]
    assert (slow.scans[0].ranges.size, usual.scans[0].ranges.size) == (90, 360)
    start = slow.trajectory.pose(0)
    assert (start.x, start.y, start.yaw) == pytest.approx((place.x, place.y, place.yaw))
    speeds = [np.hypot(*np.diff(each.trajectory.poses[:, :2], axis=0).T).max() for each in mission.robots]
    assert speeds[0] * 4.0 < 0.3 * 1.1
    assert 0.4 < speeds[1] * 10.0 < 0.6 * 1.1
    assert mission.contacts == (0, 0)


@pytest.mark.parametrize(("drive", "slack"), [("velocity", 1e-6), ("wheels", 0.4)])
def test_no_robot_speeds_up_faster_than_it_can(drive: Drive, slack: float) -> None:
    mission, _ = simulate(make_world("office", 2), MissionSettings(1, 10.0, drive=drive), 2)
    poses, limits = mission.robots[0].trajectory.poses, DriveLimits()
    speeds = np.hypot(*np.diff(poses[:, :2], axis=0).T) * 10.0
    assert np.abs(np.diff(speeds)).max() * 10.0 <= limits.acceleration * (1.0 + slack) + 1e-6
    assert speeds.max() > 0.5


def test_wheels_follow_commands_except_for_slip() -> None:
    with BulletScene(NOTHING, [SE2(40, 40, 0.5)], drive="wheels") as scene:
        scene.advance([(0.0, 1.5)], 1 / 240, 480)
        turned = scene.pose(0)
        scene.advance([(0.0, 0.0)], 1 / 240, 120)
        begin = scene.pose(0)
        scene.advance([(0.6, 0.0)], 1 / 240, 480)
        end = scene.pose(0)
    # Speeding up takes 0.25 s and 0.4 s, and half of that is lost.
    expected = 0.5 + 1.5 * (2.0 - 0.125)
    slip = abs(math.remainder(turned.yaw - expected, math.tau))
    assert 1e-5 < slip < 0.05
    assert math.dist((begin.x, begin.y), (end.x, end.y)) == pytest.approx(0.6 * (2.0 - 0.2), rel=0.02)


def test_a_lidar_on_wheels_sees_walls_and_robots_but_not_the_ground(two_rooms: World) -> None:
    starts = [SE2(1.5, 3.7, 0.4), SE2(3.0, 2.5, 0.0)]
    seen = []
    drives: tuple[Drive, ...] = ("velocity", "wheels")
    for drive in drives:
        with BulletScene(two_rooms, starts, drive=drive) as scene:
            scene.advance([(0.0, 0.0)] * 2, 1 / 240, 48)
            seen.append(scene.cast(0, Lidar()))
    assert np.median(np.abs(seen[0][0] - seen[1][0])) < 1e-3
    assert (seen[0][1] == seen[1][1]).mean() > 0.99
    assert seen[1][1].any()
    with BulletScene(NOTHING, [SE2(40, 40, 0.5)], drive="wheels") as scene:
        assert np.isinf(scene.cast(0, Lidar())[0]).all()


def test_walls_stop_wheels_which_then_slip(two_rooms: World) -> None:
    with BulletScene(two_rooms, [SE2(1.0, 2.5, math.pi)], drive="wheels") as scene:
        touched = scene.advance([(0.6, 0.0)], 1 / 240, 720)
        pose = scene.pose(0)
    assert touched.tolist() == [True]
    assert pose.x == pytest.approx(0.4, abs=0.02)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"robots": ()}, "robots is 0"),
        ({"drive": "legs"}, "drive is 'legs'"),
        ({"starts": "here"}, "starts is 'here'"),
        ({"policy": "sleep"}, "policy is 'sleep'"),
        ({"goals": [(1.0, 1.0)]}, "goals are for the policy patrol"),
        ({"policy": "patrol", "goals": [(1.0, math.nan)]}, "goals holds"),
        ({"overlap": (0.5, 0.3)}, "overlap is 0.5:0.3"),
        ({"overlap": (0.5, 1.3)}, "overlap is 0.5:1.3"),
        ({"robots": 1, "overlap": (0.1, 0.3)}, "at least two robots"),
    ],
)
def test_bad_missions_are_refused_by_name_and_value(settings: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        MissionSettings(**settings)  # type: ignore[arg-type]


@pytest.mark.parametrize(("field", "value"), [("acceleration", 0.0), ("turn_acceleration", math.nan)])
def test_bad_limits_are_refused(field: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        DriveLimits(**{field: value})
    with pytest.raises(ValueError, match="radius is 0"):
        RobotSettings(radius=0.0)
