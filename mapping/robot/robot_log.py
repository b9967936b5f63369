"""The log of one robot, and its ground truth."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.geometry.se2 import SE2
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class RobotLog:
    """The data that a real robot could record: scans, odometry and the mounting of its lidar, without any truth.

    ``odometry`` is ``odom_from_base``, one pose at the stamp of each scan; ``robot`` is the name of the robot, if it
    has one.

    Raises ``ValueError`` if scans and odometry do not match.
    """

    scans: tuple[LidarScan, ...]
    odometry: Trajectory
    base_from_lidar: SE2
    robot: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "scans", tuple(self.scans))
        _check_stamps("RobotLog", self.scans, self.odometry)

    def part(self, start: int, stop: int) -> RobotLog:
        """Return scans ``start`` to ``stop - 1``. Raises ``ValueError`` if there are none."""
        return dataclasses.replace(self, scans=self.scans[start:stop], odometry=self.odometry.part(start, stop))


@dataclass(frozen=True, eq=False)
class RobotTruth:
    """The ground truth of one robot in the simulator; the merger never reads it.

    ``trajectory`` is ``world_from_base`` at the stamp of each scan, ``scans`` hold the true ranges, and
    ``hits_robot`` (N, B) marks beams that ended on another robot.

    Raises ``ValueError`` if the three do not match.
    """

    scans: tuple[LidarScan, ...]
    trajectory: Trajectory
    hits_robot: NDArray[np.bool_]
    base_from_lidar: SE2

    def __post_init__(self) -> None:
        object.__setattr__(self, "scans", tuple(self.scans))
        object.__setattr__(self, "hits_robot", frozen_array(self.hits_robot, np.bool_))
        _check_stamps("RobotTruth", self.scans, self.trajectory)
        shape = (len(self.scans), self.scans[0].ranges.size)
        if self.hits_robot.shape != shape:
            raise ValueError(f"RobotTruth: hits_robot has shape {self.hits_robot.shape}, the scans need {shape}")

    def part(self, start: int, stop: int) -> RobotTruth:
        """Return the truth of scans ``start`` to ``stop - 1``. Raises ``ValueError`` if there are none."""
        scans, hits_robot = self.scans[start:stop], self.hits_robot[start:stop]
        return RobotTruth(scans, self.trajectory.part(start, stop), hits_robot, self.base_from_lidar)


def _check_stamps(owner: str, scans: tuple[LidarScan, ...], trajectory: Trajectory) -> None:
    if not scans:
        raise ValueError(f"{owner}: no scan")
    beams = {scan.ranges.size for scan in scans}
    if len(beams) > 1:
        raise ValueError(f"{owner}: scans of {min(beams)} and of {max(beams)} beams in one log")
    if len(scans) != len(trajectory):
        raise ValueError(f"{owner}: {len(scans)} scans, but {len(trajectory)} poses")
    for scan, stamp in zip(scans, trajectory.stamps, strict=True):
        if scan.stamp != stamp:
            raise ValueError(f"{owner}: scan at {scan.stamp} s, but pose at {stamp} s")
