"""Trajectories as TUM text files, for trajectory evaluators: ``timestamp tx ty tz qx qy qz qw``."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from mapping.io.atomic import write_bytes_atomically
from mapping.io.safe_load import read_lines
from mapping.robot.trajectory import Trajectory


def save_tum(path: Path, trajectory: Trajectory) -> None:
    """Write one line for each pose, in seconds and metres, at full precision; z, qx and qy are 0.

    Format: TUM RGB-D benchmark, https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats.
    Raises ``OSError`` if the file cannot be written.
    """
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    for stamp, (x, y, yaw) in zip(trajectory.stamps.tolist(), trajectory.poses.tolist(), strict=True):
        lines.append(f"{stamp} {x} {y} 0 0 0 {math.sin(yaw / 2.0)} {math.cos(yaw / 2.0)}")
    write_bytes_atomically(path, "\n".join([*lines, ""]).encode())


def load_tum(path: Path) -> Trajectory:
    """Read a trajectory in the plane: x, y and the yaw of the rotation, in [-pi, pi]; z, roll and pitch are dropped.

    Raises ``ValueError`` naming file and line if a line is not eight numbers, a quaternion is 0, or stamps do not
    increase; ``OSError`` if the file cannot be read.
    """
    rows = []
    for number, line in enumerate(read_lines(path), start=1):
        text = line.split("#", 1)[0].replace(",", " ").split()
        if text:
            rows.append(_row(text, f"{path}: line {number}"))
    if not rows:
        raise ValueError(f"{path}: no pose")
    values = np.array(rows)
    try:
        return Trajectory(values[:, 0], values[:, 1:])
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _row(text: list[str], place: str) -> tuple[float, float, float, float]:
    try:
        stamp, x, y, _, qx, qy, qz, qw = (float(word) for word in text)
    except ValueError:
        raise ValueError(f"{place} is {' '.join(text)[:80]!r}, must be eight numbers") from None
    if qx == qy == qz == qw == 0.0:
        raise ValueError(f"{place} has a quaternion of 0")
    # Yaw of a rotation in the order z, y, x; the quaternion's length cancels.
    yaw = math.atan2(2.0 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz)
    return stamp, x, y, yaw
