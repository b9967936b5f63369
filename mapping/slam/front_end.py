"""What a robot believes: from its log to the poses that it maps with. A scan-matching front end fits this seam."""

from __future__ import annotations

from collections.abc import Callable

from mapping.robot.robot_log import RobotLog
from mapping.robot.trajectory import Trajectory

FrontEnd = Callable[[RobotLog], Trajectory]
"""From a log to ``start_from_base``, one pose a scan, the first at the identity."""


def odometry_front_end(log: RobotLog) -> Trajectory:
    """Odometry as it stands, told in the frame of the robot's start."""
    return log.odometry.from_start()
