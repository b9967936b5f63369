"""Scans, trajectories and logs refuse invalid values."""

import math

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory


def scan(stamp=0.0, ranges=(1.0, 2.0), increment=0.1):
    return LidarScan(stamp, 0.0, increment, 0.1, 8.0, np.array(ranges, np.float32))


@pytest.mark.parametrize(
    ("ranges", "message"),
    [((1.0, math.nan), "beam 1 is NaN"), ((), "at least one beam"), ((1.0, 9.0), "outside"), ((0.01,), "outside")],
)
def test_bad_ranges_are_named(ranges, message):
    with pytest.raises(ValueError, match=message):
        scan(ranges=ranges)


def test_beams_that_exceed_a_turn_are_refused():
    with pytest.raises(ValueError, match="exceed a turn"):
        scan(ranges=[1.0] * 100)


def test_beams_that_all_point_one_way_are_refused():
    with pytest.raises(ValueError, match="angle_increment is zero"):
        scan(increment=0.0)


def test_angles_and_points_by_hand():
    scan = LidarScan(0.0, math.pi / 2, math.pi / 2, 0.1, 8.0, np.array([2.0, np.inf, 3.0], np.float32))
    assert scan.angles == pytest.approx([math.pi / 2, math.pi, 3 * math.pi / 2])
    assert scan.points() == pytest.approx(np.array([[0.0, 2.0], [0.0, -3.0]]), abs=1e-9)


@pytest.mark.parametrize("stamps", [(0.0, 0.0), (1.0, 0.5)])
def test_stamps_must_increase(stamps):
    with pytest.raises(ValueError, match="does not come after"):
        Trajectory(np.array(stamps), np.zeros((2, 3)))


def test_poses_must_be_finite():
    with pytest.raises(ValueError, match="poses"):
        Trajectory(np.array([0.0]), np.array([[0.0, math.inf, 0.0]]))


def test_moving_a_trajectory_moves_each_pose():
    trajectory = Trajectory(np.arange(3.0), np.array([[1.0, 2.0, 0.3], [2.0, 2.0, 1.0], [3.0, -1.0, 2.0]]))
    new_from_old = SE2(4.0, -2.0, 1.2)
    moved = trajectory.moved(new_from_old)
    for k in range(3):
        expected = new_from_old @ trajectory.pose(k)
        assert (moved.pose(k).x, moved.pose(k).y) == pytest.approx((expected.x, expected.y))
        assert math.remainder(moved.pose(k).yaw - expected.yaw, math.tau) == pytest.approx(0.0, abs=1e-12)
    start = trajectory.from_start().pose(0)
    assert (start.x, start.y, start.yaw) == pytest.approx((0.0, 0.0, 0.0))


def test_a_log_needs_one_pose_for_each_scan():
    poses = Trajectory(np.array([0.0, 1.0]), np.zeros((2, 3)))
    with pytest.raises(ValueError, match="1 scans, but 2 poses"):
        RobotLog((scan(),), poses, SE2())
    with pytest.raises(ValueError, match=r"scan at 0\.5 s, but pose at 1\.0 s"):
        RobotLog((scan(), scan(0.5)), poses, SE2())
    with pytest.raises(ValueError, match="scans of 1 and of 2 beams"):
        RobotLog((scan(), scan(1.0, (1.0,))), poses, SE2())


def test_arrays_inside_values_cannot_be_written():
    with pytest.raises(ValueError, match="read-only"):
        scan().ranges[0] = 3.0


def test_records_copy_their_arrays():
    ranges = np.array([1.0, 2.0], np.float32)
    kept = scan(ranges=ranges)
    ranges[0] = 5.0
    assert kept.ranges[0] == 1.0
