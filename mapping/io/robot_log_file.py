"""Robot logs as .npz files, one array for each field: equal logs give equal bytes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.io.npz_file import load_npz, save_npz
from mapping.io.safe_load import reading
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory

_PER_SCAN = ("angle_min", "angle_increment", "range_min", "range_max")
_NUMBERS = ("stamps", "odometry", "ranges", "base_from_lidar", *_PER_SCAN)
FIELDS = (*_NUMBERS, "robot")
_DIMENSIONS = {name: 2 if name in ("odometry", "ranges") else 1 for name in _NUMBERS}


def save_robot_log(path: Path, log: RobotLog) -> None:
    """Write ``stamps`` (N,) [s], ``odometry`` (N, 3) [m, m, rad], ``ranges`` (N, B) float32 [m], the lidar's mounting
    ``base_from_lidar`` (3,), per scan ``angle_min``, ``angle_increment``, ``range_min``, ``range_max`` (N,), and the
    ``robot``'s name."""
    mounting = log.base_from_lidar
    fields: dict[str, NDArray[Any]] = {
        "stamps": log.odometry.stamps,
        "odometry": log.odometry.poses,
        "ranges": np.stack([scan.ranges for scan in log.scans]),
        "base_from_lidar": np.array([mounting.x, mounting.y, mounting.yaw]),
        "robot": np.array(log.robot),
    }
    for name in _PER_SCAN:
        fields[name] = np.array([getattr(scan, name) for scan in log.scans])
    save_npz(path, fields)


def load_robot_log(path: Path) -> RobotLog:
    """Read a log of ``save_robot_log``.

    Raises ``ValueError`` that names the file and what is wrong with it, ``OSError`` if it cannot be read.
    """
    fields = load_npz(path, FIELDS)
    with reading(f"{path}: not a robot log"):
        return _robot_log(fields)


def _robot_log(fields: dict[str, NDArray[Any]]) -> RobotLog:
    for name, dimensions in _DIMENSIONS.items():
        if fields[name].ndim != dimensions or fields[name].dtype.kind not in "fiu":
            raise ValueError(f"{name} is of type {fields[name].dtype} and shape {fields[name].shape}")
    if fields["robot"].ndim != 0 or fields["robot"].dtype.kind != "U":
        raise ValueError(f"robot is of type {fields['robot'].dtype} and shape {fields['robot'].shape}")
    rows = {name: len(fields[name]) for name in _NUMBERS if name != "base_from_lidar"}
    if len(set(rows.values())) > 1:
        raise ValueError(f"the arrays do not have the same length: {rows}")
    stamps, mounting = fields["stamps"], fields["base_from_lidar"]
    if mounting.shape != (3,):
        raise ValueError(f"base_from_lidar has shape {mounting.shape}, must be (3,)")
    settings = zip(*(fields[name].tolist() for name in _PER_SCAN), strict=True)
    rows_of_scans = enumerate(zip(stamps.tolist(), settings, fields["ranges"], strict=True))
    scans = tuple(_scan(index, stamp, lidar, ranges) for index, (stamp, lidar, ranges) in rows_of_scans)
    return RobotLog(scans, Trajectory(stamps, fields["odometry"]), SE2(*mounting.tolist()), str(fields["robot"]))


def _scan(index: int, stamp: float, lidar: tuple[float, float, float, float], ranges: NDArray[Any]) -> LidarScan:
    try:
        return LidarScan(float(stamp), *lidar, ranges)
    except ValueError as error:
        raise ValueError(f"scan {index}: {error}") from None
