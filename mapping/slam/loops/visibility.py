"""Agreement of two sub-maps: each point of one against what the other saw."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.grid.frame import require_area
from mapping.slam.correlation import LikelihoodField

MARGIN_CELLS = 2.0
"""A beam shows free space up to this number of cells before its end."""


class FreeSpace(NamedTuple):
    """Cells that beams passed through, (rows, cols) of ``cell`` [m]; the corner of the first is at ``x``, ``y`` [m]."""

    x: float
    y: float
    cell: float
    free: NDArray[np.bool_]


def free_space(origins: NDArray[np.float64], ends: NDArray[np.float64], cell: float) -> FreeSpace:
    """Mark the cells between the origins (N, 2) and the ends (N, 2) of beams [m], short of the ends.

    Raises ``ValueError`` if they lie too far apart for a grid.
    """
    low = np.minimum(origins.min(axis=0), ends.min(axis=0))
    require_area("free_space", low, np.maximum(origins.max(axis=0), ends.max(axis=0)), cell)
    return _mark_free(origins, ends, cell)


@njit(cache=True)
def _mark_free(origins: NDArray[np.float64], ends: NDArray[np.float64], cell: float) -> FreeSpace:
    low_x = min(origins[:, 0].min(), ends[:, 0].min())
    low_y = min(origins[:, 1].min(), ends[:, 1].min())
    cols = int((max(origins[:, 0].max(), ends[:, 0].max()) - low_x) / cell) + 1
    rows = int((max(origins[:, 1].max(), ends[:, 1].max()) - low_y) / cell) + 1
    free = np.zeros((rows, cols), np.bool_)
    for k in range(origins.shape[0]):
        dx, dy = ends[k, 0] - origins[k, 0], ends[k, 1] - origins[k, 1]
        steps = int(math.hypot(dx, dy) / cell - MARGIN_CELLS)
        if steps < 1:
            continue
        length = math.hypot(dx, dy) / cell
        for i in range(steps + 1):
            x, y = origins[k, 0] + dx * i / length - low_x, origins[k, 1] + dy * i / length - low_y
            free[int(y / cell), int(x / cell)] = True
    return FreeSpace(low_x, low_y, cell, free)


@njit(cache=True)
def count_agreement(
    points: NDArray[np.float64],
    pose: NDArray[np.float64],
    field: LikelihoodField,
    space: FreeSpace,
    tolerance: float,
) -> tuple[int, int]:
    """Count the points (N, 2), moved by a pose, that lie within ``tolerance`` [m] of a wall, and those in free space.

    Other points lie where nothing was seen.
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    hits, passed = 0, 0
    for k in range(points.shape[0]):
        x, y = pose[0] + c * points[k, 0] - s * points[k, 1], pose[1] + s * points[k, 0] + c * points[k, 1]
        col, row = math.floor((x - field.x) / field.cell), math.floor((y - field.y) / field.cell)
        rows, cols = field.distance.shape
        if 0 <= row < rows and 0 <= col < cols and field.distance[row, col] <= tolerance:
            hits += 1
            continue
        col, row = math.floor((x - space.x) / space.cell), math.floor((y - space.y) / space.cell)
        if 0 <= row < space.free.shape[0] and 0 <= col < space.free.shape[1] and space.free[row, col]:
            passed += 1
    return hits, passed
