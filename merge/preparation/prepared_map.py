"""A map prepared for matching: its surface with normals, and look-up rasters of the nearest surface point."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array, sealed
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.preparation.correlation_pyramid import CorrelationPyramid
from merge.preparation.settings import PreparationSettings
from merge.preparation.surface import Indices, Surface, label_nearest


@dataclass(frozen=True, eq=False)
class PreparedMap:
    """A grid and what the steps of a merge derive from it, each computed when it is first used.

    Coordinates are cells from the grid's lower left corner (x, y; y up).

    - ``points`` (N, 2): the surface, centres of occupied cells beside free space, in row-major order. (Beams end
      anywhere in such a cell; the edge towards the free space would make rooms of coarser maps smaller.);
    - ``normals`` (N, 2): unit vectors into the free space, or zero if free space is on all sides;
    - ``nearest`` (4, rows, cols): index of the nearest surface point that faces right, up, left and down; N or more if
      there is none. So the two sides of a thin wall are not confused;
    - ``depth``: distance to the nearest cell that is not free; both have ``margin`` more cells on each side;
    - ``diagonal``: that of the known part's bounding box.
    """

    grid: OccupancyGrid
    settings: PreparationSettings = PreparationSettings()

    @cached_property
    def points(self) -> NDArray[np.float64]:
        rows, cols = self._cells
        return frozen_array(np.stack((cols, rows), axis=-1) + 0.5, np.float64)

    @cached_property
    def normals(self) -> NDArray[np.float64]:
        return frozen_array(_normals(self.grid, *self._cells, self.settings), np.float64)

    @cached_property
    def nearest(self) -> Indices:
        return sealed(
            _nearest(self.grid.frame.shape, *self._cells, self.normals, self.margin, self.settings.sector_cosine)
        )

    @cached_property
    def depth(self) -> NDArray[np.float32]:
        return sealed(np.pad(_depth(self.grid), self.margin))

    @cached_property
    def margin(self) -> int:
        return 2 + math.ceil(self.settings.look_up_share * self.diagonal)

    @cached_property
    def diagonal(self) -> float:
        return self.grid.known_diagonal / self.grid.frame.resolution

    @cached_property
    def _cells(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        rows, cols = np.nonzero(_surface(self.grid))
        return rows, cols

    @property
    def surface(self) -> Surface:
        """Arrays that the compiled loops read."""
        return self.points, self.normals, self.nearest, self.depth, self.margin

    @cached_property
    def layers(self) -> CorrelationPyramid:
        """Rasters of free space and walls for the correlation."""
        return CorrelationPyramid.of(self.grid.free, self.grid.occupied, _surface(self.grid), self.settings)

    @cached_property
    def middle(self) -> NDArray[np.float64]:
        """Mean (2,) of the surface points; zero if there are none."""
        return self.points.mean(axis=0) if len(self.points) else np.zeros(2)


def smaller_diagonal(target: PreparedMap, source: PreparedMap, scale: float) -> float:
    """Return the diagonal of the smaller map, in cells of the target."""
    return min(target.diagonal, scale * source.diagonal)


def _surface(grid: OccupancyGrid) -> NDArray[np.bool_]:
    beside_free = cv2.dilate(grid.free.astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)))
    return grid.occupied & (beside_free > 0)


def _normals(
    grid: OccupancyGrid, rows: NDArray[np.intp], cols: NDArray[np.intp], settings: PreparationSettings
) -> NDArray[np.float64]:
    free = np.pad(grid.free.astype(np.float32), 1)
    blurred = cv2.GaussianBlur(free, (0, 0), settings.normal_blur_cells, borderType=cv2.BORDER_CONSTANT)
    row, col = rows + 1, cols + 1
    along_x = blurred[row, col + 1].astype(np.float64) - blurred[row, col - 1]
    along_y = blurred[row + 1, col].astype(np.float64) - blurred[row - 1, col]
    normals = np.stack((along_x, along_y), axis=-1) / 2.0
    length = np.hypot(normals[:, 0], normals[:, 1])
    clear = length > settings.min_gradient
    return np.where(clear[:, None], normals / np.where(clear, length, 1.0)[:, None], 0.0)


def _nearest(
    shape: tuple[int, int],
    rows: NDArray[np.intp],
    cols: NDArray[np.intp],
    normals: NDArray[np.float64],
    margin: int,
    sector_cosine: float,
) -> Indices:
    size = 4, shape[0] + 2 * margin, shape[1] + 2 * margin
    small = len(rows) < np.iinfo(np.uint16).max  # half of what a map takes in memory
    nearest: Indices = np.empty(size, np.uint16) if small else np.empty(size, np.int32)
    every_way = ~normals.any(axis=1)
    for k, axis in enumerate(((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))):
        members = np.flatnonzero(every_way | (normals @ axis > sector_cosine))
        if members.size:
            label_nearest(nearest[k], rows[members] + margin, cols[members] + margin, members)
        else:
            nearest[k] = np.iinfo(nearest.dtype).max
    return nearest


def _depth(grid: OccupancyGrid) -> NDArray[np.float32]:
    free = np.pad(grid.free.astype(np.uint8), 1)  # beyond the raster nothing is free
    depth = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return depth[1:-1, 1:-1].astype(np.float32)
