"""Surface of a map as arrays for compiled loops, and look-ups on it."""

from __future__ import annotations

import math
from functools import lru_cache

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.arrays import frozen_array

Indices = NDArray[np.uint16] | NDArray[np.int32]

Surface = tuple[NDArray[np.float64], NDArray[np.float64], Indices, NDArray[np.float32], int]
"""Points (N, 2), normals (N, 2), nearest (4, rows, cols), depth and margin of a ``PreparedMap``."""


@njit(cache=True)
def sector(nx: float, ny: float) -> int:
    """Return the direction that a normal is nearest to: 0 to 3 for 0, 90, 180 and 270 degrees."""
    if abs(nx) >= abs(ny):
        return 0 if nx >= 0.0 else 2
    return 1 if ny >= 0.0 else 3


@njit(cache=True)
def nearest_point(surface: Surface, x: float, y: float, nx: float, ny: float) -> tuple[int, float]:
    """Find the surface point nearest to (x, y) whose normal is in the sector of (nx, ny): its index and distance.

    -1 and inf if there is none. A zero normal is in every sector.
    """
    points, _, nearest, _, margin = surface
    col, row = math.floor(x) + margin, math.floor(y) + margin
    best, best_distance = -1, math.inf
    if col < 0 or row < 0 or row >= nearest.shape[1] or col >= nearest.shape[2]:
        return best, best_distance
    everywhere = nx == 0.0 and ny == 0.0
    first = 0 if everywhere else sector(nx, ny)
    for k in range(first, 4 if everywhere else first + 1):
        index = int(nearest[k, row, col])
        if index < len(points):
            distance = math.hypot(x - points[index, 0], y - points[index, 1])
            if distance < best_distance:
                best, best_distance = index, distance
    return best, best_distance


@njit(cache=True)
def nearest_points(
    surface: Surface, points: NDArray[np.float64], normals: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Find the ``nearest_point`` of each of the points (N, 2) with normals (N, 2): indices (N,) and distances (N,)."""
    indices, distances = np.empty(len(points), np.intp), np.empty(len(points))
    for k in range(len(points)):
        indices[k], distances[k] = nearest_point(surface, points[k, 0], points[k, 1], normals[k, 0], normals[k, 1])
    return indices, distances


@njit(cache=True)
def depth_at(surface: Surface, x: float, y: float) -> float:
    """Return the distance [cells] from (x, y) to the nearest cell that is not free; 0 if it is not free itself."""
    depth, margin = surface[3], surface[4]
    col, row = math.floor(x) + margin, math.floor(y) + margin
    if col < 0 or row < 0 or row >= depth.shape[0] or col >= depth.shape[1]:
        return 0.0
    return float(depth[row, col])


@njit(cache=True)
def normal_cosine(ax: float, ay: float, bx: float, by: float) -> float:
    """Return the cosine between unit normals; 1 if either is zero, because such a wall faces every way."""
    if (ax == 0.0 and ay == 0.0) or (bx == 0.0 and by == 0.0):
        return 1.0
    return ax * bx + ay * by


@lru_cache(maxsize=256)
def thinned(length: int, most: int) -> tuple[NDArray[np.intp], float]:
    """Return at most ``most`` indices evenly over ``length``, and the number of points that each represents."""
    if length <= most:
        return frozen_array(np.arange(length), np.intp), 1.0
    return frozen_array(np.linspace(0, length - 1, most), np.intp), length / most


def centres(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the centres (N, 2), x and y in cells (``PreparedMap``), of the set cells of a raster (rows, cols)."""
    return np.argwhere(mask)[:, ::-1].astype(np.float64) + 0.5


def label_nearest(nearest: Indices, rows: NDArray[np.intp], cols: NDArray[np.intp], index: NDArray[np.intp]) -> None:
    """Write the index of the nearest point into every cell (rows, cols)."""
    elsewhere = np.ones(nearest.shape, dtype=np.uint8)
    elsewhere[rows, cols] = 0
    _, labels = cv2.distanceTransformWithLabels(elsewhere, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL)
    index_of_label = np.zeros(int(labels[rows, cols].max()) + 1, nearest.dtype)
    index_of_label[labels[rows, cols]] = index
    _look_up(index_of_label, np.asarray(labels, np.int32), nearest)


@njit(cache=True)
def _look_up(table: Indices, labels: NDArray[np.int32], out: Indices) -> None:
    for row in range(out.shape[0]):
        for col in range(out.shape[1]):
            out[row, col] = table[labels[row, col]]
