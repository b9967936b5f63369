"""Scans, poses and maps as ROS 2 messages."""

from __future__ import annotations

import math

import numpy as np
from rosbags.typesys.stores import ros2_humble as ros

from mapping.geometry.se2 import SE2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.scan import LidarScan

BAG_START = 1.0
"""ROS time of stamp 0 [s]: time 0 means "no time" to tf and to a simulated clock."""

_NANOSECONDS = 1_000_000_000
_UNKNOWN_COVARIANCE = np.zeros(36)


def ros_nanoseconds(stamp: float) -> int:
    """Convert a stamp [s] to ROS time [ns], which is ``BAG_START`` later.

    Raises ``ValueError`` if ROS time cannot hold it: not negative, 31 bits of seconds.
    """
    seconds = stamp + BAG_START
    if not 1e-9 <= seconds < 2**31 - 1:
        raise ValueError(f"stamp {stamp} s plus {BAG_START} s does not fit into ROS time")
    return round(seconds * _NANOSECONDS)


def laser_scan(scan: LidarScan, scan_time: float, frame: str) -> ros.sensor_msgs__msg__LaserScan:
    """Convert a scan, taken at one instant; ``scan_time`` [s] is the time between scans. +inf means no return, -inf
    too close (REP 117). ROS holds angles in single precision."""
    return ros.sensor_msgs__msg__LaserScan(
        header=_header(scan.stamp, frame),
        angle_min=scan.angle_min,
        angle_max=scan.angle_min + scan.angle_increment * (scan.ranges.size - 1),
        angle_increment=scan.angle_increment,
        time_increment=0.0,
        scan_time=scan_time,
        range_min=scan.range_min,
        range_max=scan.range_max,
        ranges=scan.ranges,
        intensities=np.empty(0, np.float32),
    )


def odometry(
    stamp: float, frame_from_child: SE2, twist: tuple[float, float, float], frame: str, child: str
) -> ros.nav_msgs__msg__Odometry:
    """Build odometry from a pose in ``frame`` and a twist (x, y [m/s], yaw [rad/s]) in ``child``; covariances are 0,
    which means unknown."""
    pose = ros.geometry_msgs__msg__Pose(
        position=ros.geometry_msgs__msg__Point(x=frame_from_child.x, y=frame_from_child.y, z=0.0),
        orientation=_quaternion(frame_from_child.yaw),
    )
    velocity = ros.geometry_msgs__msg__Twist(
        linear=ros.geometry_msgs__msg__Vector3(x=twist[0], y=twist[1], z=0.0),
        angular=ros.geometry_msgs__msg__Vector3(x=0.0, y=0.0, z=twist[2]),
    )
    return ros.nav_msgs__msg__Odometry(
        header=_header(stamp, frame),
        child_frame_id=child,
        pose=ros.geometry_msgs__msg__PoseWithCovariance(pose=pose, covariance=_UNKNOWN_COVARIANCE),
        twist=ros.geometry_msgs__msg__TwistWithCovariance(twist=velocity, covariance=_UNKNOWN_COVARIANCE),
    )


def transform(
    stamp: float, parent_from_child: SE2, parent: str, child: str
) -> ros.geometry_msgs__msg__TransformStamped:
    """Build a tf transform, the pose of ``child`` in ``parent``."""
    return ros.geometry_msgs__msg__TransformStamped(
        header=_header(stamp, parent),
        child_frame_id=child,
        transform=ros.geometry_msgs__msg__Transform(
            translation=ros.geometry_msgs__msg__Vector3(x=parent_from_child.x, y=parent_from_child.y, z=0.0),
            rotation=_quaternion(parent_from_child.yaw),
        ),
    )


def occupancy_grid(grid: OccupancyGrid, stamp: float, frame: str) -> ros.nav_msgs__msg__OccupancyGrid:
    """Convert a grid to a trinary map, row 0 lowest, x fastest. ROS holds the resolution in single precision."""
    rows, cols = grid.frame.shape
    origin = grid.frame.origin
    info = ros.nav_msgs__msg__MapMetaData(
        map_load_time=_time(stamp),
        resolution=grid.frame.resolution,
        width=cols,
        height=rows,
        origin=ros.geometry_msgs__msg__Pose(
            position=ros.geometry_msgs__msg__Point(x=origin.x, y=origin.y, z=0.0), orientation=_quaternion(origin.yaw)
        ),
    )
    return ros.nav_msgs__msg__OccupancyGrid(header=_header(stamp, frame), info=info, data=grid.occupancy().ravel())


def _time(stamp: float) -> ros.builtin_interfaces__msg__Time:
    seconds, nanoseconds = divmod(ros_nanoseconds(stamp), _NANOSECONDS)
    return ros.builtin_interfaces__msg__Time(sec=seconds, nanosec=nanoseconds)


def _header(stamp: float, frame: str) -> ros.std_msgs__msg__Header:
    return ros.std_msgs__msg__Header(stamp=_time(stamp), frame_id=frame)


def _quaternion(yaw: float) -> ros.geometry_msgs__msg__Quaternion:
    return ros.geometry_msgs__msg__Quaternion(x=0.0, y=0.0, z=math.sin(yaw / 2.0), w=math.cos(yaw / 2.0))
