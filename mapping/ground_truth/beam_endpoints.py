"""Estimated and true endpoints of beams, averaged over true cells: the point pairs that the truth is fitted to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.geometry.se2 import SE2
from mapping.grid.frame import require_area
from mapping.ground_truth.footprint import TRUE_RESOLUTION
from mapping.robot.robot_log import RobotLog, RobotTruth
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class BeamEndpoints:
    """Mean endpoints of a robot's beams in each true cell, ``cells`` (N, 2) row, col of the world.

    ``true`` (N, 2) are in the world [m], ``estimated`` (N, 2) in the robot's start frame [m].
    """

    cells: NDArray[np.int64]
    true: NDArray[np.float64]
    estimated: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "cells", frozen_array(self.cells, np.int64))
        object.__setattr__(self, "true", frozen_array(self.true, np.float64))
        object.__setattr__(self, "estimated", frozen_array(self.estimated, np.float64))


def beam_endpoints(
    log: RobotLog, truth: RobotTruth, start_from_base: Trajectory, replaced: NDArray[np.bool_]
) -> BeamEndpoints:
    """Compute the estimated and the true endpoints of a robot's beams, averaged over each true cell.

    ``start_from_base`` are the estimated poses, one for each scan. ``replaced`` (N, B) marks readings that the noise
    replaced; they are left out, and so are hits on robots.

    Raises ``ValueError`` if no beam is left, or the numbers of scans, poses and marks differ.
    """
    read, exact = (np.stack([scan.ranges for scan in scans]) for scans in (log.scans, truth.scans))
    if not read.shape == exact.shape == replaced.shape or len(start_from_base) != len(read):
        raise ValueError(
            f"beam_endpoints: {read.shape} measured and {exact.shape} true ranges, {replaced.shape} marks and "
            f"{len(start_from_base)} poses do not match"
        )
    usable = np.isfinite(read) & np.isfinite(exact) & ~replaced & ~truth.hits_robot
    if not usable.any():
        raise ValueError("beam_endpoints: no beam that hit the world is left to fit the truth to")
    estimated = _ends(read, *_directions(log.scans), _lidar_poses(start_from_base, log.base_from_lidar))
    true = _ends(exact, *_directions(truth.scans), _lidar_poses(truth.trajectory, truth.base_from_lidar))
    return _averaged(estimated, true, usable)


def _averaged(estimated: NDArray[np.float64], true: NDArray[np.float64], usable: NDArray[np.bool_]) -> BeamEndpoints:
    ends = true[usable]
    require_area("beam_endpoints", ends.min(axis=0), ends.max(axis=0), TRUE_RESOLUTION)
    low, high = _span(true, usable)
    rows, cols = (high - low + 1).tolist()
    place = np.full((rows, cols), -1, np.int32)
    seen, counts, sums = _sums(estimated, true, usable, low, place, min(usable.size, rows * cols))
    order = np.argsort(seen)
    means = sums[order] / counts[order, None]
    return BeamEndpoints(np.stack(np.divmod(seen[order], cols), axis=-1) + low, means[:, :2], means[:, 2:])


def _directions(scans: Sequence[LidarScan]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return cosine and sine of the beams' angles: (1, B) if all scans have the same, else (N, B)."""
    first = scans[0]
    same = all(scan.angle_min == first.angle_min and scan.angle_increment == first.angle_increment for scan in scans)
    angles = np.stack([scan.angles for scan in (scans[:1] if same else scans)])
    return np.cos(angles), np.sin(angles)


def _lidar_poses(frame_from_base: Trajectory, base_from_lidar: SE2) -> NDArray[np.float64]:
    """Return x, y, cosine and sine of yaw of the lidar at each pose, (N, 4)."""
    return _composed(frame_from_base.poses, base_from_lidar.x, base_from_lidar.y, base_from_lidar.yaw)


@njit(cache=True)
def _composed(poses: NDArray[np.float64], x: float, y: float, yaw: float) -> NDArray[np.float64]:
    composed = np.empty((poses.shape[0], 4))
    for k in range(poses.shape[0]):
        turn = _wrapped(poses[k, 2])
        c, s = math.cos(turn), math.sin(turn)
        composed[k, 0] = poses[k, 0] + c * x - s * y
        composed[k, 1] = poses[k, 1] + s * x + c * y
        turn = _wrapped(turn + yaw)
        composed[k, 2], composed[k, 3] = math.cos(turn), math.sin(turn)
    return composed


@njit(cache=True)
def _wrapped(angle: float) -> float:
    """Wrap an angle to [-pi, pi] without rounding, as ``wrap_angle`` does."""
    angle = np.fmod(angle, math.tau)
    if abs(angle) > math.pi:
        angle -= math.copysign(math.tau, angle)
    return angle


@njit(cache=True)
def _ends(
    ranges: NDArray[np.float32],
    cosines: NDArray[np.float64],
    sines: NDArray[np.float64],
    poses: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return endpoints (N, B, 2) x, y of ranges (N, B), directions (N, B) or (1, B) and the lidar's poses (N, 4)."""
    ends = np.empty((*ranges.shape, 2))
    for k in range(ranges.shape[0]):
        row = k % cosines.shape[0]
        x0, y0, c, s = poses[k]
        for b in range(ranges.shape[1]):
            reach = float(ranges[k, b])
            x, y = reach * cosines[row, b], reach * sines[row, b]
            ends[k, b, 0] = x0 + c * x - s * y
            ends[k, b, 1] = y0 + s * x + c * y
    return ends


@njit(cache=True)
def _span(true: NDArray[np.float64], usable: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the lowest and the highest row, col of the true cells in which usable beams end."""
    low_x, low_y, high_x, high_y = math.inf, math.inf, -math.inf, -math.inf
    for k in range(usable.shape[0]):
        for b in range(usable.shape[1]):
            if usable[k, b]:
                x, y = true[k, b, 0], true[k, b, 1]
                low_x, high_x = min(low_x, x), max(high_x, x)
                low_y, high_y = min(low_y, y), max(high_y, y)
    low = (math.floor(low_y / TRUE_RESOLUTION), math.floor(low_x / TRUE_RESOLUTION))
    high = (math.floor(high_y / TRUE_RESOLUTION), math.floor(high_x / TRUE_RESOLUTION))
    return np.array(low), np.array(high)


@njit(cache=True)
def _sums(
    estimated: NDArray[np.float64],
    true: NDArray[np.float64],
    usable: NDArray[np.bool_],
    low: NDArray[np.int64],
    place: NDArray[np.int32],
    most: int,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Sum up the endpoints of usable beams in each true cell.

    Returns flat indices and counts of those cells (M,), and the sums of true and estimated x, y (M, 4).
    ``place`` (rows, cols) covers the cells from ``low`` on and is -1 throughout.
    """
    seen, counts, sums, found = np.empty(most, np.int64), np.zeros(most, np.int64), np.zeros((most, 4)), 0
    for k in range(usable.shape[0]):
        for b in range(usable.shape[1]):
            if usable[k, b]:
                row = math.floor(true[k, b, 1] / TRUE_RESOLUTION) - low[0]
                col = math.floor(true[k, b, 0] / TRUE_RESOLUTION) - low[1]
                if place[row, col] < 0:
                    place[row, col], seen[found] = found, row * place.shape[1] + col
                    found += 1
                at = place[row, col]
                counts[at] += 1
                for axis in range(2):
                    sums[at, axis] += true[k, b, axis]
                    sums[at, 2 + axis] += estimated[k, b, axis]
    return seen[:found], counts[:found], sums[:found]
