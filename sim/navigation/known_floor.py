"""Floor that a robot knows to be bare: what stands there later moves, or will."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid

SURE = -1.2
"""Log-odds below which a cell is surely free: about three looks at it."""
LOG_ODDS = 5.0


class KnownFloor:
    """Grows with the map that it learns from; other robots are told from walls by standing on it."""

    def __init__(self) -> None:
        self._frame = GridFrame(1.0, SE2(), (1, 1))
        self._bare = np.zeros((1, 1), dtype=np.bool_)

    def learn(self, grid: OccupancyGrid) -> None:
        """Take in what this map, which must hold all of the maps before, is sure of; its outermost cells are not."""
        bare = ndimage.binary_erosion(grid.log_odds < SURE, np.ones((3, 3), dtype=np.bool_))
        if self._bare.any():
            bare[self._window(grid.frame)] |= self._bare
        self._frame, self._bare = grid.frame, bare

    def without_movers(self, grid: OccupancyGrid, seen: NDArray[np.float64]) -> OccupancyGrid:
        """The map with that floor bare, but for what is ``seen`` to stand there now, (N, 2) [m]."""
        log_odds = np.array(grid.log_odds)
        log_odds[self._bare & (log_odds > 0.0)] = SURE
        cells = self._frame.cells_from_metres(seen)
        log_odds[tuple(cells.T)] = LOG_ODDS
        return OccupancyGrid(grid.frame, log_odds)

    def holds(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which of the seen points, (N, 2) [m] in the map, stand on this floor, and so move, or will: (N,)."""
        local = (points - (self._frame.origin.x, self._frame.origin.y)) / self._frame.resolution
        col, row = np.floor(local).astype(np.int64).T
        rows, cols = self._frame.shape
        standing: NDArray[np.bool_] = (row >= 0) & (row < rows) & (col >= 0) & (col < cols)
        standing[standing] = self._bare[row[standing], col[standing]]
        return standing

    def _window(self, larger: GridFrame) -> tuple[slice, slice]:
        col = math.floor((self._frame.origin.x - larger.origin.x) / larger.resolution + 0.5)
        row = math.floor((self._frame.origin.y - larger.origin.y) / larger.resolution + 0.5)
        rows, cols = self._frame.shape
        return slice(row, row + rows), slice(col, col + cols)
