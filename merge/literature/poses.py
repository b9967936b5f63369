"""Rigid poses of a map in batches, for methods that search them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Poses = NDArray[np.float64]
"""Rows x, y [cells of the target], yaw [rad]: position of the middle of the source, and its rotation."""


def matrices(poses: Poses, middle: NDArray[np.float64], size: float) -> NDArray[np.float64]:
    """Compute the transforms (K, 2, 3) from cells of the source to cells of the target at poses (K, 3)."""
    c, s = size * np.cos(poses[:, 2]), size * np.sin(poses[:, 2])
    turns = np.stack((np.stack((c, -s), axis=-1), np.stack((s, c), axis=-1)), axis=-2)
    shifts = poses[:, :2] - turns @ middle
    return np.concatenate((turns, shifts[:, :, None]), axis=-1)


def inverses(forward: NDArray[np.float64]) -> NDArray[np.float64]:
    """Invert similarities (K, 2, 3)."""
    turns = np.linalg.inv(forward[:, :, :2])
    return np.concatenate((turns, -turns @ forward[:, :, 2:]), axis=-1)
