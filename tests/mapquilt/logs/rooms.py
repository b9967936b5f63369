"""Logs of a robot in a room whose walls are known exactly."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from mapping.geometry.se2 import SE2
from mapping.robot.recorded_log import RecordedLog
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory

HALF_WIDTH, HALF_HEIGHT = 4.0, 2.5
"""The room is centred at the origin of the world [m]; a post of 0.4 m stands in one corner of it."""
POST = (2.0, 1.0, 0.4)
MOUNTING = SE2(0.1, 0.05, 0.2)


def ranges_at(world_from_lidar: SE2, angles: np.ndarray) -> np.ndarray:
    """Cast rays against the four walls and the four sides of the post."""
    x0, y0 = world_from_lidar.x, world_from_lidar.y
    c, s = np.cos(angles + world_from_lidar.yaw), np.sin(angles + world_from_lidar.yaw)
    nearest = np.full(angles.size, np.inf)
    post_x, post_y, side = POST
    verticals = [(-HALF_WIDTH, -9, 9), (HALF_WIDTH, -9, 9), (post_x, post_y, post_y + side)]
    verticals.append((post_x + side, post_y, post_y + side))
    horizontals = [(-HALF_HEIGHT, -9, 9), (HALF_HEIGHT, -9, 9), (post_y, post_x, post_x + side)]
    horizontals.append((post_y + side, post_x, post_x + side))
    with np.errstate(divide="ignore", invalid="ignore"):
        for across, along, start, other, walls in ((c, s, x0, y0, verticals), (s, c, y0, x0, horizontals)):
            for place, low, high in walls:
                distance = (place - start) / across
                end = other + distance * along
                hit = (distance > 0.0) & (end >= low) & (end <= high)
                nearest = np.where(hit & (distance < nearest), distance, nearest)
    return nearest


def room_log(scans: int = 60, drift: float = 0.0) -> RecordedLog:
    """Drive a circle in the room, seen by a lidar of 120 beams; odometry whose turns are short by a share ``drift``."""
    turns = np.linspace(0.0, math.tau, scans)
    stamps = 100.0 + 0.2 * np.arange(scans)
    true = [SE2(1.2 * math.sin(a), -1.2 * math.cos(a), a) for a in turns.tolist()]
    angles = math.tau * np.arange(120) / 120 - math.pi
    sweeps = tuple(
        LidarScan(float(stamp), -math.pi, math.tau / 120, 0.05, 12.0, ranges_at(pose @ MOUNTING, angles))
        for stamp, pose in zip(stamps, true, strict=True)
    )
    odometry = [SE2()]
    for before, after in pairwise(true):
        step = before.inverse() @ after
        odometry.append(odometry[-1] @ SE2(step.x, step.y, step.yaw * (1.0 - drift)))
    log = RobotLog(sweeps, trajectory(stamps, odometry), MOUNTING, "room")
    return RecordedLog(log, trajectory(stamps, true))


def trajectory(stamps: np.ndarray, poses: list[SE2]) -> Trajectory:
    return Trajectory(stamps, [(pose.x, pose.y, pose.yaw) for pose in poses])
