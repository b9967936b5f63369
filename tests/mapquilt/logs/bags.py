"""Bags for tests, written message by message in each of the three storages."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from mapping.robot.recorded_log import RecordedLog

STORAGES = ("bag", "mcap", "db3")
Pose = Sequence[float]
"""x, y, z and roll, pitch, yaw."""


class Messages:
    """Messages of one version of ROS, in order of time."""

    def __init__(self, storage: str) -> None:
        self.storage = storage
        self.store = get_typestore(Stores.ROS1_NOETIC if storage == "bag" else Stores.ROS2_HUMBLE)
        if storage == "bag":
            definition = "geometry_msgs/TransformStamped[] transforms"
            self.store.register(get_types_from_msg(definition, "tf2_msgs/msg/TFMessage"))
        self.messages: list[tuple[str, float, Any]] = []

    def scan(self, topic: str, stamp: float, ranges: Iterable[float], frame: str = "lidar", **fields: float) -> None:
        values = {"angle_min": -1.0, "angle_increment": 0.5, "range_min": 0.1, "range_max": 10.0} | fields
        readings = np.array(list(ranges), dtype=np.float32)
        self._add(
            topic,
            stamp,
            "sensor_msgs/msg/LaserScan",
            header=self._header(stamp, frame),
            angle_max=values["angle_min"] + values["angle_increment"] * (readings.size - 1),
            time_increment=0.0,
            scan_time=0.1,
            ranges=readings,
            intensities=np.empty(0, np.float32),
            **values,
        )

    def transform(self, topic: str, stamp: float, parent: str, child: str, pose: Pose) -> None:
        make = self.store.types
        translation = make["geometry_msgs/msg/Vector3"](*map(float, pose[:3]))
        place = make["geometry_msgs/msg/Transform"](translation, self._quaternion(*pose[3:]))
        placed = make["geometry_msgs/msg/TransformStamped"](self._header(stamp, parent), child, place)
        self._add(topic, stamp, "tf2_msgs/msg/TFMessage", transforms=[placed])

    def odometry(self, topic: str, stamp: float, pose: Pose, child: str = "base") -> None:
        make = self.store.types
        position = make["geometry_msgs/msg/Point"](*map(float, pose[:3]))
        zero = make["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
        still = make["geometry_msgs/msg/Twist"](zero, zero)
        where = make["geometry_msgs/msg/Pose"](position, self._quaternion(*pose[3:]))
        self._add(
            topic,
            stamp,
            "nav_msgs/msg/Odometry",
            header=self._header(stamp, "odom"),
            child_frame_id=child,
            pose=make["geometry_msgs/msg/PoseWithCovariance"](where, np.zeros(36)),
            twist=make["geometry_msgs/msg/TwistWithCovariance"](still, np.zeros(36)),
        )

    def text(self, topic: str, stamp: float) -> None:
        self._add(topic, stamp, "std_msgs/msg/String", data="hello")

    def write(self, folder: Path) -> Path:
        """Write the bag and return its file."""
        if self.storage == "bag":
            path = folder / "log.bag"
            with Writer1(path) as writer:
                self._write(writer, self.store.serialize_ros1)
            return path
        plugin = StoragePlugin.MCAP if self.storage == "mcap" else StoragePlugin.SQLITE3
        with Writer2(folder / "log", version=8, storage_plugin=plugin) as writer:
            self._write(writer, self.store.serialize_cdr)
        (path,) = (folder / "log").glob(f"*.{self.storage}")
        return path

    def _write(self, writer: Any, serialize: Any) -> None:
        connections: dict[str, Any] = {}
        for topic, stamp, message in sorted(self.messages, key=lambda each: each[1]):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=self.store)
            writer.write(connections[topic], round(stamp * 1e9), serialize(message, message.__msgtype__))

    def _add(self, topic: str, stamp: float, kind: str, **fields: Any) -> None:
        self.messages.append((topic, stamp, self.store.types[kind](**fields)))

    def _header(self, stamp: float, frame: str) -> Any:
        seconds, nanoseconds = divmod(round(stamp * 1e9), 10**9)
        time = self.store.types["builtin_interfaces/msg/Time"](seconds, nanoseconds)
        number = {"seq": 0} if self.storage == "bag" else {}
        return self.store.types["std_msgs/msg/Header"](stamp=time, frame_id=frame, **number)

    def _quaternion(self, roll: float, pitch: float, yaw: float) -> Any:
        (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a / 2), math.sin(a / 2)) for a in (roll, pitch, yaw))
        parts = (
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        )
        return self.store.types["geometry_msgs/msg/Quaternion"](*parts)


def room_bag(storage: str, recorded: RecordedLog) -> Messages:
    """Turn a recorded log into a bag: scans, odometry and the mounting of the lidar."""
    bag, mounting, flat = Messages(storage), recorded.log.base_from_lidar, (0.0, 0.0)
    stamps, poses = recorded.log.odometry.stamps.tolist(), recorded.log.odometry.poses.tolist()
    bag.transform("/tf_static", stamps[0], "base", "lidar", (mounting.x, mounting.y, 0.2, *flat, mounting.yaw))
    for scan in recorded.log.scans:
        fields = {"angle_min": scan.angle_min, "angle_increment": scan.angle_increment}
        bag.scan(
            "/scan", scan.stamp, scan.ranges.tolist(), **fields, range_min=scan.range_min, range_max=scan.range_max
        )
    for stamp, (x, y, yaw) in zip(stamps, poses, strict=True):
        bag.odometry("/odom", stamp, (x, y, 0.0, *flat, yaw))
    return bag
