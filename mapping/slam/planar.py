"""Poses of the plane as arrays x, y [m], yaw [rad] (3,), for loops over many of them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


def compose(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a @ b."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return np.array([a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], a[2] + b[2]])


def between(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a^-1 @ b, its yaw in [-pi, pi]."""
    c, s = math.cos(a[2]), math.sin(a[2])
    x, y = b[0] - a[0], b[1] - a[1]
    return np.array([c * x + s * y, c * y - s * x, math.remainder(b[2] - a[2], math.tau)])


def rotation(yaw: float) -> NDArray[np.float64]:
    """Return the matrix (3, 3) that turns x and y and keeps yaw."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def turn_vectors(yaw: float, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn vectors (N, 2) by a yaw [rad]."""
    c, s = math.cos(yaw), math.sin(yaw)
    turned: NDArray[np.float64] = vectors @ np.array([[c, s], [-s, c]])
    return turned


def move_points(pose: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Move points (N, 2) [m] by a pose (3,)."""
    return turn_vectors(float(pose[2]), points) + pose[:2]


def inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Invert a covariance or information matrix."""
    return np.linalg.inv(matrix).astype(np.float64, copy=False)
