"""Robot logs as .npz: one array a field, the same log gives the same bytes."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np

from mapping.atomic import write_bytes_aside
from mapping.robot_log import RobotLog
from mapping.scan import LidarScan
from mapping.se2 import SE2
from mapping.trajectory import Trajectory

FIELDS = ("stamps", "odometry", "ranges", "base_from_lidar", "angle_min", "angle_increment", "range_min", "range_max")


def save_robot_log(path: Path, log: RobotLog) -> None:
    """Write ``stamps`` (N,) [s], ``odometry`` (N, 3) [m, m, rad], ``ranges`` (N, B) float32 [m], the lidar's mounting
    ``base_from_lidar`` (3,), and per scan ``angle_min``, ``angle_increment``, ``range_min``, ``range_max`` (N,)."""
    mounting = log.base_from_lidar
    fields = {
        "stamps": log.odometry.stamps,
        "odometry": log.odometry.poses,
        "ranges": np.stack([scan.ranges for scan in log.scans]),
        "base_from_lidar": np.array([mounting.x, mounting.y, mounting.yaw]),
    }
    for name in FIELDS[4:]:
        fields[name] = np.array([getattr(scan, name) for scan in log.scans])
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **fields)  # type: ignore[arg-type]
    write_bytes_aside(path, buffer.getvalue())


def load_robot_log(path: Path) -> RobotLog:
    """Read what :func:`save_robot_log` wrote.

    Raises ``ValueError`` that names the file and what is wrong with it, ``OSError`` where it cannot be read.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            fields = {name: archive[name] for name in FIELDS}
        return _robot_log(fields)
    except (KeyError, ValueError, IndexError, TypeError, EOFError, zipfile.BadZipFile, zipfile.LargeZipFile) as error:
        raise ValueError(f"{path}: not a robot log: {error}") from None


def _robot_log(fields: dict[str, np.ndarray]) -> RobotLog:
    stamps, ranges = fields["stamps"], fields["ranges"]
    if ranges.ndim != 2 or len(ranges) != len(stamps):
        raise ValueError(f"ranges has shape {ranges.shape}, but there are {len(stamps)} stamps")
    settings = zip(*(fields[name].tolist() for name in FIELDS[4:]), strict=True)
    scans = tuple(
        LidarScan(float(stamp), first, step, nearest, farthest, row)
        for stamp, (first, step, nearest, farthest), row in zip(stamps, settings, ranges, strict=True)
    )
    return RobotLog(scans, Trajectory(stamps, fields["odometry"]), SE2(*fields["base_from_lidar"].tolist()))
