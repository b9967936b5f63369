"""Mapping front ends: from a robot's log to the poses that it maps with.

Add a front end to ``FRONT_ENDS``: its name is then a value of ``mapping.poses`` everywhere (``--poses``, data sets,
studies).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from mapping.robot.robot_log import RobotLog
from mapping.robot.trajectory import Trajectory

FrontEnd = Callable[[RobotLog], Trajectory]
"""From a log to ``start_from_base``, one pose for each scan, the first at the identity."""


def odometry_front_end(log: RobotLog) -> Trajectory:
    """Return the odometry as it is, in the frame of the robot's start."""
    return log.odometry.from_start()


FRONT_ENDS: Mapping[str, FrontEnd] = MappingProxyType({"odometry": odometry_front_end})

TRUE_POSES = "truth"
"""Not a front end: the true poses, which no robot knows."""

POSES = (*FRONT_ENDS, TRUE_POSES)
"""Values of ``mapping.poses``."""
