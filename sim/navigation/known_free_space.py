"""Remember free floor, to distinguish moving objects from walls."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from sim.navigation.settings import NavigationSettings

OCCUPIED = 5.0
"""Log-odds of a cell where something stands now."""


class KnownFreeSpace:
    """Collect the cells that were once certainly free. Anything seen there later is a moving object."""

    def __init__(self, free_log_odds: float = NavigationSettings.free_log_odds) -> None:
        self._sure = free_log_odds
        self._frame = GridFrame(1.0, SE2(), (1, 1))
        self._free = np.zeros((1, 1), dtype=np.bool_)

    def update(self, grid: OccupancyGrid) -> None:
        """Add the certainly free cells of a map, which must cover all maps before it. Border cells are left out."""
        free = ndimage.binary_erosion(grid.log_odds < self._sure, np.ones((3, 3), dtype=np.bool_))
        if self._free.any():
            free[self._window(grid.frame)] |= self._free
        self._frame, self._free = grid.frame, free

    def static_map(self, grid: OccupancyGrid, seen: NDArray[np.float64]) -> OccupancyGrid:
        """Return the map with this floor free, except where ``seen`` points (N, 2) [m] lie now."""
        log_odds = np.array(grid.log_odds)
        log_odds[self._free & (log_odds > 0.0)] = self._sure
        cells = self._frame.cells_from_metres(seen)
        log_odds[tuple(cells.T)] = OCCUPIED
        return OccupancyGrid(grid.frame, log_odds)

    def contains(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which of the points (N, 2) [m] in the map lie on this floor, and so belong to moving objects: (N,)."""
        local = (points - (self._frame.origin.x, self._frame.origin.y)) / self._frame.resolution
        col, row = np.floor(local).astype(np.int64).T
        rows, cols = self._frame.shape
        standing: NDArray[np.bool_] = (row >= 0) & (row < rows) & (col >= 0) & (col < cols)
        standing[standing] = self._free[row[standing], col[standing]]
        return standing

    def _window(self, larger: GridFrame) -> tuple[slice, slice]:
        col = math.floor((self._frame.origin.x - larger.origin.x) / larger.resolution + 0.5)
        row = math.floor((self._frame.origin.y - larger.origin.y) / larger.resolution + 0.5)
        rows, cols = self._frame.shape
        return slice(row, row + rows), slice(col, col + cols)
