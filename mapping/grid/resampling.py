"""Resampling of a grid on the cells of another frame."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.arrays import sealed
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid

LEAST_SAMPLES = 4
"""Sample points along each side of a new cell; more if new cells are larger."""


class Resampling:
    """A grid to resample on the cells of ``frame``, some rows at a time: see ``resampled``."""

    def __init__(
        self,
        grid: OccupancyGrid,
        frame_from_grid: Similarity2,
        frame: GridFrame,
        least_samples: int = LEAST_SAMPLES,
    ) -> None:
        self.frame, self._old = frame, grid.log_odds
        self._affine = _cell_affine(grid.frame, frame_from_grid.inverse(), frame)
        self._samples = max(least_samples, math.ceil(2.0 * math.hypot(self._affine[0, 0], self._affine[1, 0])))
        walls = np.argwhere(grid.occupied)
        cells = frame.cells_from_metres(frame_from_grid.apply(grid.frame.metres_from_cells(walls)))
        self._walls = walls
        self._rows, self._cols = (cells[:, k].clip(0, frame.shape[k] - 1) for k in range(2))

    def rows(self, first: int, last: int) -> NDArray[np.float32]:
        """Return the log-odds (last - first, cols) of these rows of the frame."""
        log_odds = _resample(self._old, self._affine, self._samples, first, (last - first, self.frame.shape[1]))
        here = (self._rows >= first) & (self._rows < last)
        walls = self._walls[here]
        places = self._rows[here] - first, self._cols[here]
        np.maximum.at(log_odds, places, self._old[walls[:, 0], walls[:, 1]])
        return log_odds


def resampled(
    grid: OccupancyGrid, frame_from_grid: Similarity2, frame: GridFrame, least_samples: int = LEAST_SAMPLES
) -> NDArray[np.float32]:
    """Resample a grid on the cells of ``frame``, its metres moved by ``frame_from_grid``: log-odds (rows, cols).

    A cell is occupied if it contains the centre of an occupied cell or is covered by occupied cells by half, so that
    walls of one cell survive coarser cells and keep their width in finer ones. Else it is unknown if unknown cells
    cover more than half of it, else free. Its log-odds are the mean over the samples of that kind.
    """
    return Resampling(grid, frame_from_grid, frame, least_samples).rows(0, frame.shape[0])


def coarsened(grid: OccupancyGrid, times: int) -> OccupancyGrid:
    """Join blocks of ``times`` cells a side: occupied if any cell is, else free if any is. Walls get no thinner."""
    rows, cols = (math.ceil(side / times) for side in grid.frame.shape)
    frame = GridFrame(grid.frame.resolution * times, grid.frame.origin, (rows, cols))
    return OccupancyGrid(frame, sealed(_coarsen(grid.log_odds, times, frame.shape)))


def _cell_affine(old: GridFrame, old_from_new: Similarity2, new: GridFrame) -> NDArray[np.float64]:
    """Return the (2, 3) map from (x, y, 1) in cells of the new grid to x, y in cells of the old one."""
    cells = (
        Similarity2.from_se2(old.origin, old.resolution).inverse()
        @ old_from_new
        @ Similarity2.from_se2(new.origin, new.resolution)
    )
    return cells.matrix()


@njit(cache=True)
def _resample(
    old: NDArray[np.float32], affine: NDArray[np.float64], samples: int, first: int, shape: tuple[int, int]
) -> NDArray[np.float32]:
    new = np.zeros(shape, np.float32)
    for row in range(shape[0]):
        for col in range(shape[1]):
            occupied, free, sum_occupied, sum_free = 0, 0, 0.0, 0.0
            for i in range(samples):
                y = first + row + (i + 0.5) / samples
                for j in range(samples):
                    x = col + (j + 0.5) / samples
                    c = math.floor(affine[0, 0] * x + affine[0, 1] * y + affine[0, 2])
                    r = math.floor(affine[1, 0] * x + affine[1, 1] * y + affine[1, 2])
                    if r < 0 or c < 0 or r >= old.shape[0] or c >= old.shape[1]:
                        continue
                    value = old[r, c]
                    if value > 0.0:
                        occupied, sum_occupied = occupied + 1, sum_occupied + value
                    elif value < 0.0:
                        free, sum_free = free + 1, sum_free + value
            if 2 * occupied >= samples * samples:
                new[row, col] = sum_occupied / occupied
            elif free > 0 and 2 * (occupied + free) >= samples * samples:
                new[row, col] = sum_free / free
    return new


@njit(cache=True)
def _coarsen(old: NDArray[np.float32], times: int, shape: tuple[int, int]) -> NDArray[np.float32]:
    new = np.zeros(shape, np.float32)
    for row in range(old.shape[0]):
        for col in range(old.shape[1]):
            value, best = old[row, col], new[row // times, col // times]
            if value > max(best, 0.0) or (value < best <= 0.0):
                new[row // times, col // times] = value
    return new
