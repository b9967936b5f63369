"""Mapping front ends: from a robot's log to the poses that it maps with.

To add one, list it in ``FRONT_ENDS``, and its name in ``POSES`` of ``mapping/slam/settings.py``: it is then a value of
``mapping.poses`` everywhere (``--poses``, data sets, studies).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from mapping.robot.robot_log import RobotLog
from mapping.robot.trajectory import Trajectory
from mapping.slam.pipeline import slam
from mapping.slam.result import SlamResult
from mapping.slam.settings import SlamSettings

FrontEnd = Callable[[RobotLog, SlamSettings, Callable[[int], None]], SlamResult]
"""From a log, the settings of SLAM, and a function that is called with the number of scans done, to poses
``start_from_base``, one for each scan, the first at the identity."""


def odometry_front_end(log: RobotLog, settings: SlamSettings, on_scan: Callable[[int], None]) -> SlamResult:
    """Return the odometry as it is, in the frame of the robot's start."""
    on_scan(len(log.scans))
    return without_graph(log.odometry.from_start())


def without_graph(trajectory: Trajectory) -> SlamResult:
    """Return poses that no graph was optimised for."""
    return SlamResult(trajectory, np.empty(0, np.int64), ())


FRONT_ENDS: Mapping[str, FrontEnd] = MappingProxyType({"slam": slam, "odometry": odometry_front_end})
