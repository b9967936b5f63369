"""Frames of a bag: from transforms in space to the mounting of a lidar and the odometry, in the plane."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.robot.trajectory import Trajectory

LEAST_UPRIGHT = 0.9
"""Least cosine of a lidar's tilt against the horizontal, 26 degrees: beyond, its scan is no plan of the walls."""

_CONSTANT = 1e-6  # greatest change [m, or of a quaternion's parts] of a transform that is published again and again


@dataclass
class PoseSeries:
    """Poses in space, as they come: stamps [s], and rows of x, y, z [m] and a quaternion x, y, z, w."""

    stamps: array[float] = field(default_factory=lambda: array("d"))
    numbers: array[float] = field(default_factory=lambda: array("d"))

    def add(self, stamp: float, numbers: Iterable[float]) -> None:
        self.stamps.append(stamp)
        self.numbers.extend(numbers)

    def rows(self) -> NDArray[np.float64]:
        """Return the poses, (N, 7)."""
        return np.array(self.numbers).reshape(-1, 7)

    def moves(self) -> bool:
        """Return whether the poses differ; a quaternion and its negative are one rotation."""
        rows = self.rows()
        signs = np.where(rows[:, 3:] @ rows[0, 3:] < 0.0, -1.0, 1.0)
        rows[:, 3:] *= signs[:, None]
        return bool(np.abs(rows - rows[0]).max() > _CONSTANT)

    def trajectory(self) -> Trajectory:
        """Return x, y and yaw of the poses whose stamps increase."""
        rows = self.rows()
        x, y, z, w = rows[:, 3:].T
        yaw = np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
        stamps = np.array(self.stamps)
        later = np.concatenate(([True], stamps[1:] > np.maximum.accumulate(stamps)[:-1]))
        return Trajectory(stamps[later], np.column_stack((rows[:, :2], yaw))[later])

    def matrix(self) -> NDArray[np.float64]:
        """Return the first pose as a matrix (4, 4)."""
        x, y, z, w = self.rows()[0, 3:] / np.linalg.norm(self.rows()[0, 3:])
        matrix = np.eye(4)
        matrix[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        matrix[:3, 3] = self.rows()[0, :3]
        return matrix


@dataclass(frozen=True)
class Mounting:
    """Pose of a lidar on its base in the plane; ``upside_down`` if its z axis points to the floor, which turns the
    order of its beams around."""

    base_from_lidar: SE2 = field(default_factory=SE2)
    upside_down: bool = False


def ancestors(frame: str, parent_of: Mapping[str, str]) -> tuple[str, ...]:
    """Return a frame and its parents up to the root; a frame that comes again ends the list."""
    chain = [frame]
    while chain[-1] in parent_of and parent_of[chain[-1]] not in chain:
        chain.append(parent_of[chain[-1]])
    return tuple(chain)


def moving_frame(chain: Sequence[str], transforms: Mapping[str, PoseSeries]) -> str | None:
    """Return the first frame of a chain that moves against its parent: the base, whose parent is the odometry's
    frame. None if nothing moves."""
    return next((frame for frame in chain if frame in transforms and transforms[frame].moves()), None)


def mounting(chain: Sequence[str], base: str | None, transforms: Mapping[str, PoseSeries]) -> Mounting:
    """Compose the transforms from the lidar, the first frame of the chain, to the base; None: to the root.

    Raises ``ValueError`` if the lidar is tilted too far for a map of the plane.
    """
    base_from_lidar = np.eye(4)
    for frame in chain:
        if frame == base or frame not in transforms:
            break
        base_from_lidar = transforms[frame].matrix() @ base_from_lidar
    upright = float(base_from_lidar[2, 2])
    if abs(upright) < LEAST_UPRIGHT:
        tilt = math.degrees(math.acos(min(abs(upright), 1.0)))
        raise ValueError(f"frame {chain[0]} is tilted by {tilt:.0f} degrees, must lie within 25 of the horizontal")
    yaw = math.atan2(base_from_lidar[1, 0], base_from_lidar[0, 0])
    return Mounting(SE2(float(base_from_lidar[0, 3]), float(base_from_lidar[1, 3]), yaw), upright < 0.0)
