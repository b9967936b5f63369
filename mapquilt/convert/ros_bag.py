"""ROS 2 bag of a run, as input of slam_toolbox, cartographer and map mergers. Needs the extra ``[ros]``.

/tf_static                 base_link -> lidar of every robot
/tf                        odom -> base_link, at the stamp of each scan
/NAME/odom                 nav_msgs/Odometry, the same pose with its twist
/NAME/ground_truth         nav_msgs/Odometry in the frame ``world``; no part of tf, where base_link has a parent already
/NAME/scan                 sensor_msgs/LaserScan
/NAME/map                  nav_msgs/OccupancyGrid, the robot's map in its perturbed frame, after its last scan

The frames are ``NAME/map``, ``NAME/odom``, ``NAME/base_link`` and ``NAME/lidar``. ``map -> odom`` is left out:
the mapper that runs on the bag publishes it, and two publishers would conflict.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from rosbags.interfaces import Connection, Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.stores import ros2_humble as ros

from mapping.robot.trajectory import Trajectory
from mapquilt.convert.ros_messages import laser_scan, occupancy_grid, odometry, ros_nanoseconds, transform
from mapquilt.runs.robot import RunRobot

BAG_NAME = "bag"

_VERSION: Final = 8  # of the metadata: from 9 on ROS 2 Humble cannot read it
_STORE = get_typestore(Stores.ROS2_HUMBLE)
_FOREVER = QosTime(9223372036, 854775807)


def write_bag(folder: Path, robots: Sequence[RunRobot]) -> None:
    """Write ``bag.mcap`` and ``metadata.yaml`` into a folder that holds neither; the same robots give the same bytes.

    Bag time is the log's time plus ``BAG_START``. Raises ``ValueError`` for a stamp that ROS time cannot hold,
    ``OSError`` if the folder cannot be written.
    """
    moments = sorted(
        (ros_nanoseconds(scan.stamp), index, k)
        for index, robot in enumerate(robots)
        for k, scan in enumerate(robot.log.scans)
    )
    with new_bag(folder) as bag:
        start = moments[0][0]
        bag.write("/tf_static", ros.tf2_msgs__msg__TFMessage([mounting(robot) for robot in robots]), start)
        for nanoseconds, index, k in moments:
            robot = robots[index]
            for topic, message in scan_messages(robot, k):
                bag.write(topic, message, nanoseconds)
            if k == len(robot.log.scans) - 1:
                grid = occupancy_grid(robot.grid, robot.log.scans[k].stamp, f"{robot.name}/map")
                bag.write(f"/{robot.name}/map", grid, nanoseconds)


@contextmanager
def new_bag(folder: Path) -> Iterator[BagWriter]:
    """Open a new ``bag.mcap`` and its ``metadata.yaml`` in a folder that holds neither; both are complete at the end of
    the block."""
    inner = folder / BAG_NAME  # the writer insists on making the folder, and names the storage after it
    with Writer(inner, version=_VERSION, storage_plugin=StoragePlugin.MCAP) as writer:
        yield BagWriter(writer)
    for path in sorted(inner.iterdir()):
        path.rename(folder / path.name)
    inner.rmdir()


class BagWriter:
    """Write messages to topics, which are declared on first use."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._connections: dict[str, Connection] = {}

    def write(self, topic: str, message: Any, nanoseconds: int) -> None:
        kind = message.__msgtype__
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(
                topic, kind, typestore=_STORE, offered_qos_profiles=[_quality(topic)]
            )
        self._writer.write(self._connections[topic], nanoseconds, _STORE.serialize_cdr(message, kind))


def _quality(topic: str) -> Qos:
    # Late subscribers still get the map and the static transforms.
    latched = topic.endswith(("/map", "/map_merged", "/tf_static", "/conflicts"))
    return Qos(
        QosHistory.KEEP_LAST,
        1 if latched else 100,
        QosReliability.RELIABLE,
        QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
        _FOREVER,
        _FOREVER,
        QosLiveliness.AUTOMATIC,
        _FOREVER,
        False,
    )


def mounting(robot: RunRobot) -> ros.geometry_msgs__msg__TransformStamped:
    """Return the static transform of a robot's lidar on its base."""
    base, lidar = f"{robot.name}/base_link", f"{robot.name}/lidar"
    return transform(robot.log.scans[0].stamp, robot.log.base_from_lidar, base, lidar)


def scan_messages(robot: RunRobot, k: int) -> Iterator[tuple[str, Any]]:
    """Yield topic and message of one robot's scan ``k``, tf first, so that the scan can be transformed on arrival."""
    name, scan = robot.name, robot.log.scans[k]
    odom, base = f"{name}/odom", f"{name}/base_link"
    odom_from_base = robot.log.odometry.pose(k)
    yield "/tf", ros.tf2_msgs__msg__TFMessage([transform(scan.stamp, odom_from_base, odom, base)])
    yield f"/{name}/odom", odometry(scan.stamp, odom_from_base, _twist(robot.log.odometry, k), odom, base)
    true = odometry(scan.stamp, robot.world_from_base.pose(k), _twist(robot.world_from_base, k), "world", base)
    yield f"/{name}/ground_truth", true
    yield f"/{name}/scan", laser_scan(scan, _scan_time(robot.log.odometry, k), f"{name}/lidar")


def _twist(frame_from_base: Trajectory, k: int) -> tuple[float, float, float]:
    """Return the mean velocity since the previous pose, in the base frame of that pose; 0 at the first."""
    if k == 0:
        return 0.0, 0.0, 0.0
    before_from_now = frame_from_base.pose(k - 1).inverse() @ frame_from_base.pose(k)
    elapsed = _scan_time(frame_from_base, k)
    return before_from_now.x / elapsed, before_from_now.y / elapsed, before_from_now.yaw / elapsed


def _scan_time(frame_from_base: Trajectory, k: int) -> float:
    """Return the time since the previous scan [s]; at the first, until the next."""
    if len(frame_from_base) == 1:
        return 0.0
    k = max(k, 1)
    return float(frame_from_base.stamps[k] - frame_from_base.stamps[k - 1])
