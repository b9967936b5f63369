"""Logs out of ROS bags: three storages, odometry of three kinds, mountings, refusals."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory
from mapquilt.convert.ros_bag import write_bag
from mapquilt.convert.ros_messages import BAG_START
from mapquilt.logs.bag_log import load_bag
from mapquilt.runs.robot import RunRobot
from tests.mapquilt.convert.test_ros_bag import made_up_robot
from tests.mapquilt.logs.bags import STORAGES, Messages

FLAT = (0.0, 0.0, 0.0)


def moving(storage: str) -> Messages:
    """A robot that drives along y at 1 m/s, known from tf alone, with a lidar on a mast."""
    bag = Messages(storage)
    bag.transform("/tf_static", 10.0, "mast", "lidar", (0.1, 0.0, 0.2, 0.0, 0.0, 0.5))
    bag.transform("/tf_static", 10.0, "base", "mast", (0.0, 0.2, 1.0, *FLAT))
    for k in range(6):
        bag.transform("/tf", 10.0 + k, "/odom", "/base", (0.0, float(k), 0.0, 0.0, 0.0, 0.1 * k))
        bag.transform("/tf", 10.0 + k, "map", "odom", (5.0 * k, 0.0, 0.0, *FLAT))
    for k in range(5):
        bag.scan("/scan", 10.5 + k, (1.0, math.inf, math.nan, 0.05, 11.0))
    return bag


@pytest.mark.parametrize("storage", STORAGES)
def test_odometry_and_mounting_come_from_tf(tmp_path: Path, storage: str) -> None:
    read = load_bag(moving(storage).write(tmp_path))
    assert (read.has_odometry, read.reference, read.warnings) == (True, None, ())
    np.testing.assert_allclose(read.log.odometry.stamps, 10.5 + np.arange(5))
    np.testing.assert_allclose(read.log.odometry.poses[:, 1], 0.5 + np.arange(5))
    np.testing.assert_allclose(read.log.odometry.poses[:, 2], 0.05 + 0.1 * np.arange(5))
    mounted = read.log.base_from_lidar
    np.testing.assert_allclose((mounted.x, mounted.y, mounted.yaw), (0.1, 0.2, 0.5))
    np.testing.assert_array_equal(read.log.scans[0].ranges, np.float32([1.0, np.inf, np.inf, -np.inf, np.inf]))


def test_the_folder_of_a_bag_is_read_too(tmp_path: Path) -> None:
    path = moving("mcap").write(tmp_path)
    assert len(load_bag(path.parent).log.scans) == 5


@pytest.mark.parametrize("named", [None, "/wheels"])
def test_odometry_comes_from_its_topic_if_tf_has_none_or_it_is_named(tmp_path: Path, named: str | None) -> None:
    bag = moving("mcap") if named else Messages("mcap")
    if not named:
        bag.transform("/tf_static", 10.0, "base", "lidar", (0.3, 0.0, 0.2, *FLAT))
        bag.scan("/scan", 10.5, (1.0, 2.0))
    for k in range(6):
        bag.odometry("/wheels", 10.0 + k, (float(k), 0.0, 0.0, 0.0, 0.0, 3.0 + 0.2 * k))
    read = load_bag(bag.write(tmp_path), odom_topic=named)
    np.testing.assert_allclose(read.log.odometry.poses[0], (0.5, 0.0, 3.1))
    assert read.log.base_from_lidar.x == pytest.approx(0.1 if named else 0.3)


def test_a_bag_of_scans_alone_has_no_odometry(tmp_path: Path) -> None:
    bag = Messages("mcap")
    for k in range(3):
        bag.scan("/scan", 1.0 + k, (1.0, 2.0))
    read = load_bag(bag.write(tmp_path))
    assert not read.has_odometry
    np.testing.assert_array_equal(read.log.odometry.poses, np.zeros((3, 3)))


def test_a_lidar_without_transform_counts_as_the_base(tmp_path: Path) -> None:
    bag = Messages("mcap")
    bag.scan("/scan", 1.5, (1.0, 2.0))
    for k in range(3):
        bag.odometry("/odom", 1.0 + k, (float(k), 0.0, 0.0, *FLAT))
    read = load_bag(bag.write(tmp_path))
    assert read.log.base_from_lidar == SE2()
    assert read.warnings == ("no transform from base to lidar: the lidar counts as the base",)


def test_beams_of_an_upside_down_lidar_have_the_right_endpoints(tmp_path: Path) -> None:
    bag = Messages("mcap")
    bag.transform("/tf_static", 1.0, "base", "lidar", (0.1, 0.2, 0.5, math.pi, 0.0, 0.7))
    bag.scan("/scan", 1.0, (1.0, 2.0, 3.0), angle_min=-0.2)
    log = load_bag(bag.write(tmp_path)).log
    ends = log.base_from_lidar.apply(log.scans[0].points())
    # A rotation by pi about x turns y and z around; then by 0.7 about z; then the shift.
    angles = np.array([-0.2, 0.3, 0.8])
    lidar = np.column_stack((np.cos(angles), -np.sin(angles))) * np.array([[1.0], [2.0], [3.0]])
    np.testing.assert_allclose(ends[::-1], SE2(0.1, 0.2, 0.7).apply(lidar), atol=1e-6)


def test_a_tilted_lidar_is_refused(tmp_path: Path) -> None:
    bag = Messages("mcap")
    bag.transform("/tf_static", 1.0, "base", "lidar", (0.0, 0.0, 0.5, 0.0, 0.8, 0.0))
    bag.scan("/scan", 1.0, (1.0, 2.0))
    with pytest.raises(ValueError, match="frame lidar is tilted by 46 degrees, must lie within 25"):
        load_bag(bag.write(tmp_path))


def test_a_fast_lidar_is_thinned_while_it_is_read(tmp_path: Path) -> None:
    bag = Messages("mcap")
    for k in range(81):
        bag.scan("/scan", 1.0 + k / 40.0, (1.0, 2.0))
    path = bag.write(tmp_path)
    np.testing.assert_allclose(np.diff(load_bag(path, max_rate=5.0).log.odometry.stamps)[1:], 0.2)
    assert len(load_bag(path, max_rate=100.0).log.scans) == 81


def test_scans_outside_the_odometry_or_of_other_beams_are_dropped(tmp_path: Path) -> None:
    bag = moving("mcap")
    bag.scan("/scan", 9.0, (1.0,) * 5)
    bag.scan("/scan", 14.9, (1.0,) * 4)
    read = load_bag(bag.write(tmp_path))
    assert len(read.log.scans) == 5
    assert read.warnings == (
        "1 scan dropped, of 4 beams, not 5; the first: stamp 14.900 s",
        "1 scan dropped, outside the time of the poses",
    )


def test_a_converted_run_is_read_back(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    robots = [_upright(made_up_robot(name, rng, start)) for name, start in (("robot_0", 0.0), ("robot_1", 0.03))]
    write_bag(tmp_path, robots)
    for robot in robots:
        read = load_bag(tmp_path, scan_topic=f"/{robot.name}/scan", max_rate=1000.0).log
        np.testing.assert_allclose(read.odometry.stamps, robot.log.odometry.stamps + BAG_START, atol=1e-8)
        np.testing.assert_allclose(read.odometry.poses, robot.log.odometry.poses, atol=1e-9)
        np.testing.assert_array_equal([scan.ranges for scan in read.scans], [scan.ranges for scan in robot.log.scans])
        mounted = read.base_from_lidar
        expected = robot.log.base_from_lidar
        np.testing.assert_allclose((mounted.x, mounted.y, mounted.yaw), (expected.x, expected.y, expected.yaw))


def _upright(robot: RunRobot) -> RunRobot:
    """Keep yaw within a turn, as a quaternion does."""
    poses = robot.log.odometry.poses.copy()
    poses[:, 2] = np.clip(poses[:, 2], -1.5, 1.5)
    scans: tuple[LidarScan, ...] = robot.log.scans
    log = RobotLog(scans, Trajectory(robot.log.odometry.stamps, poses), robot.log.base_from_lidar)
    return RunRobot(robot.name, log, robot.grid, robot.world_from_base)


def test_one_of_several_scan_topics_must_be_chosen(tmp_path: Path) -> None:
    bag = moving("mcap")
    bag.scan("/rear", 10.5, (1.0, 2.0))
    path = bag.write(tmp_path)
    with pytest.raises(
        ValueError, match=r"2 topics of sensor_msgs/LaserScan; `mapquilt map --scan-topic` takes one of /rear, /scan"
    ):
        load_bag(path)
    assert load_bag(path, scan_topic="/rear").log.scans[0].ranges.size == 2


def test_one_of_several_odometry_topics_must_be_chosen_where_tf_has_none(tmp_path: Path) -> None:
    bag = Messages("mcap")
    bag.scan("/scan", 1.5, (1.0, 2.0))
    for k in range(3):
        bag.odometry("/a", 1.0 + k, (float(k), 0.0, 0.0, *FLAT))
        bag.odometry("/b", 1.0 + k, (2.0 * k, 0.0, 0.0, *FLAT))
    path = bag.write(tmp_path)
    with pytest.raises(
        ValueError, match=r"2 topics of nav_msgs/Odometry; `mapquilt map --odom-topic` takes one of /a, /b"
    ):
        load_bag(path)
    assert load_bag(path, odom_topic="/b").log.odometry.poses[0, 0] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("topic", "message"),
    [
        ("/chat", r"--scan-topic /chat is of type std_msgs/msg/String, must be sensor_msgs/LaserScan: /scan"),
        ("/none", r"--scan-topic /none is not in the bag, must be sensor_msgs/LaserScan: /scan"),
    ],
)
def test_a_topic_of_another_type_is_refused(tmp_path: Path, topic: str, message: str) -> None:
    bag = moving("mcap")
    bag.text("/chat", 10.0)
    with pytest.raises(ValueError, match=message):
        load_bag(bag.write(tmp_path), scan_topic=topic)


def test_a_bag_without_scans_lists_its_topics(tmp_path: Path) -> None:
    bag = Messages("mcap")
    bag.text("/chat", 10.0)
    with pytest.raises(ValueError, match=r"no topic of sensor_msgs/LaserScan, only /chat \(std_msgs/String\)"):
        load_bag(bag.write(tmp_path))


@pytest.mark.parametrize("storage", STORAGES)
def test_a_damaged_bag_is_refused_by_its_name(tmp_path: Path, storage: str) -> None:
    path = moving(storage).write(tmp_path)
    data = path.read_bytes()
    cut = tmp_path / f"cut{path.suffix}"
    for share in (0, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99):
        cut.write_bytes(data[: int(share * len(data))])
        with pytest.raises(ValueError, match=rf"cut\.{storage}: "):
            load_bag(cut)
