"""A map made ready for comparison: its surface, and how far every cell lies from it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.grid import OccupancyGrid

NORMAL_BLUR_CELLS = 1.2
MARGIN_SHARE = 0.06
"""The rasters reach this share of the diagonal beyond the map, so that walls just outside find their nearest."""


@dataclass(frozen=True, eq=False)
class Chart:
    """A grid and what is asked of it again and again, in cells from the grid's lower left corner (x, y; y up).

    ``points`` (N, 2) are the surface: where an occupied cell meets free space, on the face between the two, in
    row-major order. ``normals`` (N, 2) are unit vectors into the free space, or zero where it lies on all sides
    alike. ``nearest`` is the index of the nearest surface point, -1 if there is none, and ``depth`` the distance to
    the nearest cell that is not free; both are rasters with ``margin`` more cells on each side. ``diagonal`` is that
    of the known part's bounding box.
    """

    grid: OccupancyGrid
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    nearest: NDArray[np.int32]
    depth: NDArray[np.float32]
    margin: int
    diagonal: float

    @staticmethod
    def of(grid: OccupancyGrid) -> Chart:
        rows, cols = np.nonzero(_surface(grid))
        normals = _normals(grid)[rows, cols]
        diagonal = _known_diagonal(grid)
        margin = 2 + math.ceil(MARGIN_SHARE * diagonal)
        return Chart(
            grid=grid,
            points=frozen_array(np.stack((cols, rows), axis=-1) + 0.5 + 0.5 * normals, np.float64),
            normals=frozen_array(normals, np.float64),
            nearest=frozen_array(_nearest(grid.frame.shape, rows, cols, margin), np.int32),
            depth=frozen_array(np.pad(_depth(grid), margin), np.float32),
            margin=margin,
            diagonal=diagonal,
        )

    def cells_of(self, points: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.bool_]]:
        """Row and column in the padded rasters of points (N, 2), and which lie inside; those outside get (0, 0)."""
        cells = np.floor(points).astype(np.intp) + self.margin
        rows, cols = self.nearest.shape
        inside = (cells[:, 0] >= 0) & (cells[:, 0] < cols) & (cells[:, 1] >= 0) & (cells[:, 1] < rows)
        cells[~inside] = 0
        return cells[:, 1], cells[:, 0], inside

    def nearest_to(self, points: NDArray[np.float64]) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Index of the nearest surface point and the distance to it [cells], for points (N, 2); -1 and inf if none."""
        if not len(self.points):
            return np.full(len(points), -1, dtype=np.int32), np.full(len(points), np.inf)
        rows, cols, inside = self.cells_of(points)
        index = np.where(inside, self.nearest[rows, cols], np.int32(-1))
        distance = np.hypot(*(points - self.points[index]).T)
        return index, np.where(inside, distance, np.inf)

    def depth_at(self, points: NDArray[np.float64]) -> NDArray[np.float32]:
        """How deep in free space the points (N, 2) lie [cells]; 0 where it is not free."""
        rows, cols, inside = self.cells_of(points)
        return np.where(inside, self.depth[rows, cols], np.float32(0.0))


def _surface(grid: OccupancyGrid) -> NDArray[np.bool_]:
    beside_free = cv2.dilate(grid.free.astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)))
    return grid.occupied & (beside_free > 0)


def _normals(grid: OccupancyGrid) -> NDArray[np.float64]:
    free = np.pad(grid.free.astype(np.float64), 1)
    blurred = cv2.GaussianBlur(free, (0, 0), NORMAL_BLUR_CELLS, borderType=cv2.BORDER_CONSTANT)
    along_y, along_x = np.gradient(blurred)
    normals = np.stack((along_x, along_y), axis=-1)[1:-1, 1:-1]
    length = np.hypot(normals[..., 0], normals[..., 1])
    clear = length > 0.02  # a straight wall has 0.2 to 0.3
    return np.where(clear[..., None], normals / np.where(clear, length, 1.0)[..., None], 0.0)


def _known_diagonal(grid: OccupancyGrid) -> float:
    rows, cols = np.nonzero(grid.known)
    return math.hypot(np.ptp(rows) + 1, np.ptp(cols) + 1) if rows.size else 0.0


def _nearest(shape: tuple[int, int], rows: NDArray[np.intp], cols: NDArray[np.intp], margin: int) -> NDArray[np.int32]:
    elsewhere = np.ones((shape[0] + 2 * margin, shape[1] + 2 * margin), dtype=np.uint8)
    if not rows.size:
        return np.full(elsewhere.shape, -1, dtype=np.int32)
    elsewhere[rows + margin, cols + margin] = 0
    _, labels = cv2.distanceTransformWithLabels(elsewhere, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL)
    index_of_label = np.full(int(labels.max()) + 1, -1, dtype=np.int32)
    index_of_label[labels[rows + margin, cols + margin]] = np.arange(rows.size, dtype=np.int32)
    nearest: NDArray[np.int32] = index_of_label[labels]
    return nearest


def _depth(grid: OccupancyGrid) -> NDArray[np.float32]:
    free = np.pad(grid.free.astype(np.uint8), 1)  # beyond the raster nothing is free
    depth = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return depth[1:-1, 1:-1].astype(np.float32)
