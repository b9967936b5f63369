"""ROS 2 bag of a run, read by two libraries and compared with the logs, the truth and the maps."""

from __future__ import annotations

import math
import struct
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory
from mapquilt.convert.ros_bag import write_bag
from mapquilt.convert.ros_messages import ros_nanoseconds
from mapquilt.runs.robot import RunRobot, load_run_robots
from tests.conftest import command, hashes

STORE = get_typestore(Stores.ROS2_HUMBLE)
MOUNTING = SE2(0.2, -0.1, 0.5)


def made_up_robot(name: str, rng: np.random.Generator, start: float) -> RunRobot:
    """A robot whose every number is its own: a mounted lidar, beams lost and too close, a turned map."""
    stamps = start + np.cumsum(rng.uniform(0.05, 0.15, 6))
    ranges = rng.uniform(0.2, 12.0, (6, 7)).astype(np.float32)
    ranges[:, 2], ranges[1, 3] = np.inf, -np.inf
    scans = [LidarScan(stamp, -2.0, 0.7, 0.1, 12.0, row) for stamp, row in zip(stamps.tolist(), ranges, strict=True)]
    log = RobotLog(tuple(scans), Trajectory(stamps, rng.normal(size=(6, 3))), MOUNTING)
    frame = GridFrame(0.0537, SE2(*rng.normal(size=3)), (3, 5))
    grid = OccupancyGrid(frame, rng.choice([-1.5, 0.0, 2.5], (3, 5)).astype(np.float32))
    return RunRobot(name, log, grid, Trajectory(stamps, rng.normal(size=(6, 3))))


@pytest.fixture(scope="module")
def robots() -> tuple[RunRobot, ...]:
    rng = np.random.default_rng(11)
    return made_up_robot("robot_0", rng, 0.0), made_up_robot("robot_1", rng, 0.03)


@pytest.fixture(scope="module")
def bag(robots: tuple[RunRobot, ...], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bag")
    write_bag(folder, robots)
    return folder


Messages = dict[str, list[tuple[int, Any]]]


def by_rosbags(bag: Path) -> Messages:
    messages: Messages = {}
    with Reader(bag) as reader:
        for connection, time, data in reader.messages():
            messages.setdefault(connection.topic, []).append((time, STORE.deserialize_cdr(data, connection.msgtype)))
    return messages


def by_mcap(bag: Path) -> Messages:
    messages: Messages = {}
    with (bag / "bag.mcap").open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            assert schema is not None
            value = STORE.deserialize_cdr(message.data, schema.name)
            messages.setdefault(channel.topic, []).append((message.log_time, value))
    return messages


@pytest.fixture(params=[by_rosbags, by_mcap], ids=["rosbags", "mcap"])
def messages(request: pytest.FixtureRequest, bag: Path) -> Messages:
    read: Messages = request.param(bag)
    return read


def nanoseconds(stamp: Any) -> int:
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def planar(position: Any, rotation: Any) -> tuple[float, float, float]:
    assert position.z == rotation.x == rotation.y == 0.0
    quaternion = Rotation.from_quat([rotation.x, rotation.y, rotation.z, rotation.w])
    return position.x, position.y, float(quaternion.as_euler("xyz")[2])


def assert_poses(found: list[tuple[float, float, float]], poses: np.ndarray) -> None:
    found_array = np.array(found)
    np.testing.assert_array_equal(found_array[:, :2], poses[:, :2])
    turned = [math.remainder(yaw, math.tau) for yaw in found_array[:, 2] - poses[:, 2]]
    np.testing.assert_allclose(turned, 0.0, atol=1e-12)


def test_topics_types_and_numbers(bag: Path, messages: Messages) -> None:
    names = ("robot_0", "robot_1")
    expected = {"/tf": ("tf2_msgs/msg/TFMessage", 12), "/tf_static": ("tf2_msgs/msg/TFMessage", 1)}
    for name in names:
        expected[f"/{name}/scan"] = "sensor_msgs/msg/LaserScan", 6
        expected[f"/{name}/odom"] = "nav_msgs/msg/Odometry", 6
        expected[f"/{name}/ground_truth"] = "nav_msgs/msg/Odometry", 6
        expected[f"/{name}/map"] = "nav_msgs/msg/OccupancyGrid", 1
    found = {topic: (entries[0][1].__msgtype__, len(entries)) for topic, entries in messages.items()}
    assert found == expected
    info = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert info["message_count"] == sum(count for _, count in expected.values())
    assert (info["storage_identifier"], info["relative_file_paths"]) == ("mcap", ["bag.mcap"])
    assert info["version"] < 9  # which ROS 2 Humble cannot read


def test_scans_are_the_logs_scans(messages: Messages, robots: tuple[RunRobot, ...]) -> None:
    for robot in robots:
        for (time, message), scan in zip(messages[f"/{robot.name}/scan"], robot.log.scans, strict=True):
            assert time == nanoseconds(message.header.stamp) == round((scan.stamp + 1.0) * 1e9)
            assert message.header.frame_id == f"{robot.name}/lidar"
            np.testing.assert_array_equal(message.ranges, scan.ranges)
            assert message.ranges.dtype == np.float32
            limits = (message.angle_min, message.angle_increment, message.range_min, message.range_max)
            assert limits == tuple(np.float32([-2.0, 0.7, 0.1, 12.0]).tolist())
            # What karto makes of the three angles must be the number of ranges.
            assert round((message.angle_max - message.angle_min) / message.angle_increment) + 1 == scan.ranges.size
            assert message.time_increment == 0.0
            assert message.intensities.size == 0


def test_scan_time_is_the_time_between_scans(messages: Messages, robots: tuple[RunRobot, ...]) -> None:
    times = [message.scan_time for _, message in messages["/robot_1/scan"]]
    gaps = np.diff(robots[1].log.odometry.stamps)
    np.testing.assert_allclose(times, [gaps[0], *gaps], rtol=1e-6)


def test_tf_is_the_odometry_at_the_scans_stamps(messages: Messages, robots: tuple[RunRobot, ...]) -> None:
    transforms = [entry for _, message in messages["/tf"] for entry in message.transforms]
    parents = Counter((entry.child_frame_id, entry.header.frame_id) for entry in transforms)
    # Every child has one parent, and nothing ties map to odom: that is for the mapper to find.
    assert parents == {(f"{robot.name}/base_link", f"{robot.name}/odom"): 6 for robot in robots}
    for robot in robots:
        own = [entry for entry in transforms if entry.child_frame_id == f"{robot.name}/base_link"]
        scans = [message for _, message in messages[f"/{robot.name}/scan"]]
        assert [nanoseconds(e.header.stamp) for e in own] == [nanoseconds(s.header.stamp) for s in scans]
        poses = [planar(entry.transform.translation, entry.transform.rotation) for entry in own]
        assert_poses(poses, robot.log.odometry.poses)


def test_the_mounting_is_static(messages: Messages, robots: tuple[RunRobot, ...]) -> None:
    ((time, message),) = messages["/tf_static"]
    assert time == min(entry[0][0] for entry in messages.values())
    for entry, robot in zip(message.transforms, robots, strict=True):
        assert (entry.header.frame_id, entry.child_frame_id) == (f"{robot.name}/base_link", f"{robot.name}/lidar")
        found = planar(entry.transform.translation, entry.transform.rotation)
        assert found == pytest.approx((0.2, -0.1, 0.5))


@pytest.mark.parametrize("topic", ["odom", "ground_truth"])
def test_odometry_and_truth(messages: Messages, robots: tuple[RunRobot, ...], topic: str) -> None:
    for robot in robots:
        path = robot.log.odometry if topic == "odom" else robot.world_from_base
        read = [message for _, message in messages[f"/{robot.name}/{topic}"]]
        assert_poses([planar(m.pose.pose.position, m.pose.pose.orientation) for m in read], path.poses)
        parent = f"{robot.name}/odom" if topic == "odom" else "world"
        assert {(m.header.frame_id, m.child_frame_id) for m in read} == {(parent, f"{robot.name}/base_link")}
        assert [nanoseconds(m.header.stamp) for m in read] == [ros_nanoseconds(stamp) for stamp in path.stamps]
        # Carried on for the time since the scan before, the twist leads from the pose before to this one.
        for k in range(1, 6):
            twist, elapsed = read[k].twist.twist, path.stamps[k] - path.stamps[k - 1]
            step = SE2(twist.linear.x * elapsed, twist.linear.y * elapsed, twist.angular.z * elapsed)
            arrived, pose = path.pose(k - 1) @ step, path.pose(k)
            assert (arrived.x, arrived.y) == pytest.approx((pose.x, pose.y))
            assert math.remainder(arrived.yaw - pose.yaw, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_maps_are_those_with_perturbed_frames(messages: Messages, robots: tuple[RunRobot, ...]) -> None:
    for robot in robots:
        ((time, message),) = messages[f"/{robot.name}/map"]
        assert time == nanoseconds(message.info.map_load_time) == ros_nanoseconds(robot.log.scans[-1].stamp)
        assert message.header.frame_id == f"{robot.name}/map"
        cells = message.data.reshape(message.info.height, message.info.width)
        assert cells.dtype == np.int8
        np.testing.assert_array_equal(cells, robot.grid.occupancy())
        frame = robot.grid.frame
        assert message.info.resolution == np.float32(frame.resolution)
        origin = (frame.origin.x, frame.origin.y, frame.origin.yaw)
        assert planar(message.info.origin.position, message.info.origin.orientation) == pytest.approx(origin)


def test_messages_are_in_order_and_tf_comes_before_its_scan(bag: Path) -> None:
    with (bag / "bag.mcap").open("rb") as file:
        order = [(m.log_time, c.topic) for _, c, m in make_reader(file).iter_messages(log_time_order=False)]
    assert order == sorted(order, key=lambda entry: entry[0])
    assert order[0][1] == "/tf_static"
    topics = [topic for _, topic in order]
    for k, topic in enumerate(topics):
        if topic.endswith("/scan"):
            assert topics[k - 3] == "/tf"


def test_maps_and_static_transforms_are_latched(bag: Path) -> None:
    with Reader(bag) as reader:
        for connection in reader.connections:
            (quality,) = connection.ext.offered_qos_profiles
            latched = connection.topic == "/tf_static" or connection.topic.endswith("/map")
            expected = QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE
            assert (quality.durability, quality.reliability) == (expected, QosReliability.RELIABLE)


def test_the_ranges_are_at_the_offset_of_the_message_definition(bag: Path, robots: tuple[RunRobot, ...]) -> None:
    """A third reading of one scan, by hand: little-endian CDR, each number aligned to its own size."""
    with (bag / "bag.mcap").open("rb") as file:
        _, _, message = next(make_reader(file).iter_messages(topics=["/robot_0/scan"]))
    body = message.data[4:]
    assert message.data[:4] == b"\x00\x01\x00\x00"
    length = struct.unpack_from("<I", body, 8)[0]
    assert body[12 : 12 + length] == b"robot_0/lidar\x00"
    start = 12 + length + -(12 + length) % 4
    *_, count = struct.unpack_from("<7fI", body, start)
    ranges = struct.unpack_from(f"<{count}f", body, start + 32)
    assert ranges == tuple(robots[0].log.scans[0].ranges.tolist())


@pytest.mark.parametrize("stamp", [-1.0, -5.0, 2.0**31, 1e300])
def test_a_stamp_beyond_ros_time_is_refused(stamp: float) -> None:
    with pytest.raises(ValueError, match="does not fit into ROS time"):
        ros_nanoseconds(stamp)


def test_a_run_becomes_the_same_bag_twice(merged_run: Path, tmp_path: Path) -> None:
    for name in ("first", "second"):
        assert command("convert", merged_run, tmp_path / name, "--to", "rosbag") == 0
    assert hashes(tmp_path / "first") == hashes(tmp_path / "second")
    assert set(hashes(tmp_path / "first")) == {"bag.mcap", "metadata.yaml"}
    robots = load_run_robots(merged_run)
    read = by_mcap(tmp_path / "first")
    for robot in robots:
        assert len(read[f"/{robot.name}/scan"]) == len(robot.log.scans)
        np.testing.assert_array_equal(read[f"/{robot.name}/map"][0][1].data, robot.grid.occupancy().ravel())
