"""Look-up of the nearest wall cell for many points at once."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

Complex = NDArray[np.complex128]
"""Points x + i y, so that a turn is a product."""


@dataclass(frozen=True, eq=False)
class NearestWall:
    """``points`` (N,) are centres of cells; ``index`` (rows, cols) that of the one nearest to each cell's centre, and
    ``corner`` the column and row of its first cell."""

    points: Complex
    index: NDArray[np.int32]
    corner: tuple[int, int]

    @staticmethod
    def of(points: Complex, reach: float) -> NearestWall:
        """Build the raster for at least one point, up to ``reach`` cells beyond their bounding box.

        Source: exact Euclidean distance transform (Maurer, Qi and Raghavan 2003), by SciPy.
        """
        cols, rows = np.floor(points.real).astype(np.int64), np.floor(points.imag).astype(np.int64)
        margin = math.ceil(reach) + 1
        first_col, first_row = int(cols.min()) - margin, int(rows.min()) - margin
        cols, rows = cols - first_col, rows - first_row
        index = np.full((rows.max() + margin + 1, cols.max() + margin + 1), -1, np.int32)
        index[rows, cols] = np.arange(len(points))
        row, col = distance_transform_edt(index < 0, return_distances=False, return_indices=True)
        return NearestWall(points, index[row, col], (first_col, first_row))

    def query(self, points: Complex) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Find distance and index of the nearest point to each of the points (K, M).

        Candidates are those nearest to the point's own cell and the eight around it. Beyond the reach the result is one
        near the border.
        """
        return _query(self.points, self.index, self.corner, points)


@njit(cache=True)
def _query(
    walls: Complex, index: NDArray[np.int32], corner: tuple[int, int], points: Complex
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    rows, cols = index.shape
    distances, found = np.empty(points.shape, np.float64), np.empty(points.shape, np.int32)
    for k in range(points.shape[0]):
        for i in range(points.shape[1]):
            x, y = points[k, i].real, points[k, i].imag
            col = min(max(math.floor(x) - corner[0], 1), cols - 2)
            row = min(max(math.floor(y) - corner[1], 1), rows - 2)
            least, best = math.inf, -1
            for beside in range(9):
                candidate = index[row - 1 + beside // 3, col - 1 + beside % 3]
                square = (walls[candidate].real - x) ** 2 + (walls[candidate].imag - y) ** 2
                if square < least:
                    least, best = square, candidate
            distances[k, i], found[k, i] = math.sqrt(least), best
    return distances, found
