"""A log of a robot that drives a round in a room with a niche, seen exactly, with the odometry that a test asks for."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory

CORNERS = np.array([(-4.0, -2.0), (5.0, -2.0), (5.0, 3.0), (2.0, 3.0), (2.0, 4.5), (-4.0, 4.5)])
BEAMS = 360
BASE_FROM_LIDAR = SE2(0.1, 0.0, 0.2)


def true_path(scans: int = 60, turns: float = 1.0) -> Trajectory:
    """Drive along an ellipse, from the identity."""
    along = math.tau * turns * np.arange(scans) / scans
    x, y = 2.5 * np.sin(along), 1.5 - 1.5 * np.cos(along)
    yaw = np.unwrap(np.arctan2(1.5 * np.sin(along), 2.5 * np.cos(along)))
    return Trajectory(0.5 * np.arange(scans), np.column_stack((x, y, yaw)))


def room_log(true: Trajectory, odometry: Trajectory | None = None) -> RobotLog:
    """Scan the room along a path; the odometry is exact if none is given."""
    scans = tuple(scan_at(true.pose(k) @ BASE_FROM_LIDAR, float(stamp)) for k, stamp in enumerate(true.stamps.tolist()))
    return RobotLog(scans, true if odometry is None else odometry, BASE_FROM_LIDAR)


def scan_at(world_from_lidar: SE2, stamp: float) -> LidarScan:
    step = math.tau / BEAMS
    angles = world_from_lidar.yaw - math.pi + step * np.arange(BEAMS)
    ranges = cast(np.array([world_from_lidar.x, world_from_lidar.y]), angles)
    return LidarScan(stamp, -math.pi, step, 0.1, 12.0, ranges.astype(np.float32))


def cast(start: NDArray[np.float64], angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distances (B,) to the nearest wall."""
    ways = np.column_stack((np.cos(angles), np.sin(angles)))
    nearest = np.full(angles.size, np.inf)
    for a, b in zip(CORNERS, np.roll(CORNERS, -1, axis=0), strict=True):
        wall, offset = b - a, a - start
        across = ways[:, 0] * wall[1] - ways[:, 1] * wall[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            length = (offset[0] * wall[1] - offset[1] * wall[0]) / across
            share = (offset[0] * ways[:, 1] - offset[1] * ways[:, 0]) / across
        hit = (length > 0.0) & (share >= 0.0) & (share <= 1.0)
        nearest = np.where(hit, np.minimum(nearest, length), nearest)
    return nearest


def drifting(true: Trajectory, stretch: float, veer: float) -> Trajectory:
    """Return odometry whose steps are longer by a factor of 1 + ``stretch``, and turn by ``veer`` [rad] more each."""
    pose, poses = SE2(), [(0.0, 0.0, 0.0)]
    for k in range(1, len(true)):
        step = true.pose(k - 1).inverse() @ true.pose(k)
        pose = pose @ SE2((1.0 + stretch) * step.x, (1.0 + stretch) * step.y, step.yaw + veer)
        poses.append((pose.x, pose.y, pose.yaw))
    return Trajectory(true.stamps, np.array(poses))
