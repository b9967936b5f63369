"""Robot logs as CARMEN text, for gmapping and many older mappers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mapping.geometry.se2 import SE2
from mapping.io.atomic import write_bytes_atomically
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory

_HEADER = """\
# CARMEN Logfile
# ROBOTLASER1 laser_type start_angle field_of_view angular_resolution maximum_range accuracy remission_mode \
num_readings [readings] num_remissions [remissions] laser_pose_x laser_pose_y laser_pose_theta robot_pose_x \
robot_pose_y robot_pose_theta laser_tv laser_rv forward_safety_dist side_safety_dist turn_axis ipc_timestamp \
ipc_hostname logger_timestamp
# TRUEPOS true_x true_y true_theta odom_x odom_y odom_theta ipc_timestamp ipc_hostname logger_timestamp
"""
_SIMULATED_LASER = 99
_BEYOND = 1.0  # how far beyond maximum_range a beam without a return is written [m]: CARMEN has no infinity


def save_carmen(path: Path, log: RobotLog, truth: Trajectory | None = None) -> None:
    """Write one ROBOTLASER1 line for each scan, after a TRUEPOS line if the true trajectory is given.

    ROBOTLASER1 states the directions of the beams; the older FLASER always means a forward half turn. A beam without a
    return reads more than ``maximum_range``, one to something too close reads 0. ``truth`` is ``world_from_base`` at
    the scans' stamps. Numbers have full precision. Format: the header of CARMEN's own logger (carmen.sourceforge.net).

    Raises ``ValueError`` if the truth has other stamps than the log, ``OSError`` if the file cannot be written.
    """
    if truth is not None and not np.array_equal(truth.stamps, log.odometry.stamps):
        raise ValueError("save_carmen: the truth and the log have different stamps")
    lines = []
    for index, scan in enumerate(log.scans):
        odom_from_base = log.odometry.pose(index)
        if truth is not None:
            lines.append(_truepos(truth.pose(index), odom_from_base, scan.stamp))
        lines.append(_robotlaser(scan, odom_from_base, odom_from_base @ log.base_from_lidar))
    write_bytes_atomically(path, (_HEADER + "\n".join([*lines, ""])).encode())


def _truepos(world_from_base: SE2, odom_from_base: SE2, stamp: float) -> str:
    return f"TRUEPOS {_pose(world_from_base)} {_pose(odom_from_base)} {_times(stamp)}"


def _robotlaser(scan: LidarScan, odom_from_base: SE2, odom_from_lidar: SE2) -> str:
    beams = scan.ranges.size
    field_of_view = scan.angle_increment * (beams - 1)
    sensor = f"{_SIMULATED_LASER} {scan.angle_min} {field_of_view} {scan.angle_increment} {scan.range_max} 0 0"
    ranges = np.where(np.isposinf(scan.ranges), np.float32(scan.range_max + _BEYOND), scan.ranges)
    readings = " ".join(map(str, np.where(np.isneginf(ranges), np.float32(0.0), ranges)))
    motion_and_safety = "0 0 0 0 0"
    return (
        f"ROBOTLASER1 {sensor} {beams} {readings} 0 "
        f"{_pose(odom_from_lidar)} {_pose(odom_from_base)} {motion_and_safety} {_times(scan.stamp)}"
    )


def _pose(pose: SE2) -> str:
    return f"{pose.x} {pose.y} {pose.yaw}"


def _times(stamp: float) -> str:
    return f"{stamp} mapquilt {stamp}"
