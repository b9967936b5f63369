"""Where beams were believed to end and where they truly ended, by true cell: what the truth is fitted on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.footprint import TRUE_RESOLUTION
from mapping.robot_log import RobotLog, RobotTruth
from mapping.scan import LidarScan
from mapping.se2 import SE2
from mapping.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Sightings:
    """True cells (N, 2) row, col of the world where a robot's beams ended, and the mean place of those ends:
    ``true`` (N, 2) in the world [m], ``believed`` (N, 2) in the robot's start frame [m]."""

    cells: NDArray[np.int64]
    true: NDArray[np.float64]
    believed: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "cells", frozen_array(self.cells, np.int64))
        object.__setattr__(self, "true", frozen_array(self.true, np.float64))
        object.__setattr__(self, "believed", frozen_array(self.believed, np.float64))


def sightings(log: RobotLog, truth: RobotTruth, start_from_base: Trajectory, replaced: NDArray[np.bool_]) -> Sightings:
    """Where beams were believed to end and where they truly ended, averaged over each true cell.

    ``start_from_base`` are the believed poses, one a scan; ``replaced`` (N, B) marks readings that noise made up.
    Those are left out, and so are hits on robots.

    Raises ``ValueError`` where no beam is left, or scans, poses and marks are not equally many.
    """
    read, exact = (np.stack([scan.ranges for scan in scans]) for scans in (log.scans, truth.scans))
    if not read.shape == exact.shape == replaced.shape or len(start_from_base) != len(read):
        raise ValueError(
            f"sightings: {read.shape} ranges were read of {exact.shape} true ones, with {replaced.shape} marks, "
            f"at {len(start_from_base)} poses"
        )
    ends = np.empty((read.size, 4))
    count = _beam_ends(
        ends,
        (read, *_directions(log.scans), _lidar_poses(start_from_base, log.base_from_lidar)),
        (exact, *_directions(truth.scans), _lidar_poses(truth.trajectory, truth.base_from_lidar)),
        ~(replaced | truth.hits_robot),
    )
    if not count:
        raise ValueError("sightings: no beam that hit the world is left to fit the truth on")
    return _averaged(ends[:count, 2:], ends[:count, :2])


def _averaged(true: NDArray[np.float64], believed: NDArray[np.float64]) -> Sightings:
    cells = np.floor(true[:, ::-1] / TRUE_RESOLUTION).astype(np.int64)
    corner = cells.min(axis=0)
    rows, cols = (cells.max(axis=0) - corner + 1).tolist()
    index = (cells - corner) @ np.array([cols, 1])
    seen, counts, sums = _sums(index, np.full(rows * cols, -1, np.int32), true, believed)
    order = np.argsort(seen)
    means = sums[order] / counts[order, None]
    return Sightings(np.stack(np.divmod(seen[order], cols), axis=-1) + corner, means[:, :2], means[:, 2:])


def _directions(scans: Sequence[LidarScan]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cosine and sine of the beams' angles, (1, B) where all scans have the same, else (N, B)."""
    first = scans[0]
    same = all(scan.angle_min == first.angle_min and scan.angle_increment == first.angle_increment for scan in scans)
    angles = np.stack([scan.angles for scan in (scans[:1] if same else scans)])
    return np.cos(angles), np.sin(angles)


def _lidar_poses(frame_from_base: Trajectory, base_from_lidar: SE2) -> NDArray[np.float64]:
    """x, y, cosine and sine of yaw of the lidar at each pose, (N, 4)."""
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
    """The same angle in [-pi, pi], without rounding, as ``wrap_angle`` has it."""
    angle = np.fmod(angle, math.tau)
    if abs(angle) > math.pi:
        angle -= math.copysign(math.tau, angle)
    return angle


Beams = tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Ranges (N, B), cosine and sine of the beams' angles, and the lidar's poses."""


@njit(cache=True)
def _beam_ends(ends: NDArray[np.float64], read: Beams, exact: Beams, usable: NDArray[np.bool_]) -> int:
    """Fill in the believed x, y and the true x, y of each usable beam that returned; how many those are."""
    count = 0
    for k in range(usable.shape[0]):
        for b in range(usable.shape[1]):
            if usable[k, b] and math.isfinite(read[0][k, b]) and math.isfinite(exact[0][k, b]):
                ends[count, 0], ends[count, 1] = _beam_end(read, k, b)
                ends[count, 2], ends[count, 3] = _beam_end(exact, k, b)
                count += 1
    return count


@njit(cache=True)
def _beam_end(beams: Beams, k: int, b: int) -> tuple[float, float]:
    ranges, cosines, sines, poses = beams
    row = k % cosines.shape[0]
    reach = float(ranges[k, b])
    x, y = reach * cosines[row, b], reach * sines[row, b]
    c, s = poses[k, 2], poses[k, 3]
    return poses[k, 0] + c * x - s * y, poses[k, 1] + s * x + c * y


@njit(cache=True)
def _sums(
    index: NDArray[np.int64], place: NDArray[np.int32], true: NDArray[np.float64], believed: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """The different values of ``index``, how often each stands there, and the sums of its points (M, 4). ``place`` is
    as long as values go, and -1 throughout."""
    seen = np.empty(index.size, np.int64)
    counts = np.zeros(index.size, np.int64)
    sums = np.zeros((index.size, 4))
    found = 0
    for k in range(index.size):
        at = place[index[k]]
        if at < 0:
            at = found
            place[index[k]] = at
            seen[at] = index[k]
            found += 1
        counts[at] += 1
        for axis in range(2):
            sums[at, axis] += true[k, axis]
            sums[at, 2 + axis] += believed[k, axis]
    return seen[:found], counts[:found], sums[:found]
