"""Mapping front ends: from a robot's log to the poses that it maps with. A scan matcher has the same signature."""

from __future__ import annotations

from collections.abc import Callable

from mapping.robot.robot_log import RobotLog
from mapping.robot.trajectory import Trajectory

FrontEnd = Callable[[RobotLog], Trajectory]
"""From a log to ``start_from_base``, one pose for each scan, the first at the identity."""


def odometry_front_end(log: RobotLog) -> Trajectory:
    """Return the odometry as it is, in the frame of the robot's start."""
    return log.odometry.from_start()
