"""Poses of the plane as arrays x, y [m], yaw [rad] (3,), for loops over many of them."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
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


@njit(cache=True)
def turn_vectors(yaw: float, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn vectors (N, 2) by a yaw [rad]."""
    c, s = math.cos(yaw), math.sin(yaw)
    turned = np.empty_like(vectors)
    for k in range(vectors.shape[0]):
        turned[k, 0] = c * vectors[k, 0] - s * vectors[k, 1]
        turned[k, 1] = s * vectors[k, 0] + c * vectors[k, 1]
    return turned


@njit(cache=True)
def turn_each(yaws: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn each of the vectors (N, 2) by its own yaw (N,) [rad]."""
    turned = np.empty_like(vectors)
    for k in range(vectors.shape[0]):
        c, s = math.cos(yaws[k]), math.sin(yaws[k])
        turned[k, 0] = c * vectors[k, 0] - s * vectors[k, 1]
        turned[k, 1] = s * vectors[k, 0] + c * vectors[k, 1]
    return turned


def move_points(pose: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Move points (N, 2) [m] by a pose (3,)."""
    return turn_vectors(float(pose[2]), points) + pose[:2]
