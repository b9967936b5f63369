"""SLAM of several robots in one pose graph, in worlds whose truth is known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.robot.trajectory import Trajectory
from mapping.slam.pipeline import slam, slam_together
from mapping.slam.settings import MotionSettings, SlamSettings
from tests.mapping.slam.rooms import along, log_of, path_error, ring_corridor

LOWER = np.array([(15.0, 14.0), (15.0, 1.0), (1.0, 1.0), (1.0, 7.0)])
UPPER = np.array([(1.0, 2.0), (1.0, 15.0), (15.0, 15.0), (15.0, 9.0)])
OFF = SE2(0.4, -0.3, math.radians(2.0))


@pytest.fixture(scope="module")
def robots():
    """Two robots that drive two halves of a corridor; the poses of their starts are known by 0.5 m and 2 degrees."""
    made = [
        log_of(ring_corridor(), along(path, speed=0.1), noise=0.03, odometry_noise=2.0, seed=seed, beams=180)
        for seed, path in enumerate((LOWER, UPPER))
    ]
    (first, true), (second, other) = made
    return [first, second], [true, other], OFF @ true.pose(0).inverse() @ other.pose(0)


@pytest.fixture(scope="module")
def joint(robots):
    logs, _, start = robots
    return slam_together([(logs[0], SE2.identity()), (logs[1], start)])


def concatenated(trajectories):
    poses = np.concatenate([each.poses for each in trajectories])
    return Trajectory(np.arange(len(poses), dtype=float), poses)


def test_robots_that_met_one_another_s_walls_share_a_frame(robots, joint):
    _, true, start = robots
    rough = concatenated([slam(robots[0][0]).trajectory, slam(robots[0][1]).trajectory.moved(start)])
    assert joint.loops_between(0, 1) > 0
    assert joint.loops_between(0, 1) == joint.loops_between(1, 0)
    together = path_error(concatenated(joint.trajectories), concatenated(true))
    assert together < 0.06
    assert together < 0.5 * path_error(rough, concatenated(true))


def test_the_frame_is_that_of_the_first_start(joint):
    np.testing.assert_allclose(joint.trajectories[0].poses[0], 0.0, atol=1e-12)


def test_one_robot_together_is_that_robot_alone(robots):
    log = robots[0][0].part(0, 120)
    joint, alone = slam_together([(log, SE2(5.0, 1.0, 2.0))]), slam(log)
    assert joint.trajectories[0].poses.tobytes() == alone.trajectory.poses.tobytes()


def test_equal_logs_give_equal_bytes(robots):
    logs, _, start = robots
    few = [(logs[0].part(0, 100), SE2.identity()), (logs[1].part(0, 100), start)]
    one, other = slam_together(few), slam_together(few)
    assert [each.poses.tobytes() for each in one.trajectories] == [each.poses.tobytes() for each in other.trajectories]


def test_robots_that_saw_nothing_in_common_are_not_linked(robots):
    """The first robot's first metres and the second's lie on opposite sides of the block."""
    logs, true, _ = robots
    start = true[0].pose(0).inverse() @ true[1].pose(0)
    joint = slam_together([(logs[0].part(0, 60), SE2.identity()), (logs[1].part(0, 60), start)])
    assert joint.loops_between(0, 1) == 0


def test_edges_within_a_robot_and_between_robots_hold_true_poses(robots, joint):
    _, true, _ = robots
    poses = [pose for each in true for pose in (each.pose(k) for k in range(len(each)))]
    for edge in joint.edges:
        if edge.loop is None:
            continue
        first, second = (poses[joint.keyframes[k]] for k in (edge.first, edge.second))
        off = (first.inverse() @ second).inverse() @ edge.first_from_second
        assert math.hypot(off.x, off.y) < 0.3
        assert abs(off.yaw) < 0.05


def test_logs_without_odometry_are_joined_too(robots):
    logs, true, start = robots
    settings = replace(SlamSettings(), motion=MotionSettings(odometry=False))
    joint = slam_together([(logs[0], SE2.identity()), (logs[1], start)], settings)
    assert path_error(concatenated(joint.trajectories), concatenated(true)) < 0.3
