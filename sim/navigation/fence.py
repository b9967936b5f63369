"""Treat a fence, which no lidar sees, as a wall."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.occupancy_grid import OccupancyGrid
from sim.navigation.settings import NavigationSettings
from worlds.polygon import Polygon, edges

OCCUPIED = 10.0
"""Log-odds of the fence's cells."""


class Fence:
    """Add a fence to maps and to seen points. An ``outline`` of None adds nothing; points are ``spacing`` [m] apart."""

    def __init__(self, outline: Polygon | None, spacing: float = NavigationSettings.fence_spacing) -> None:
        pieces = [] if outline is None else [_points(start, end, spacing) for start, end in edges(outline)]
        self._points = np.concatenate(pieces) if pieces else np.empty((0, 2))

    def add_to_grid(self, grid: OccupancyGrid) -> OccupancyGrid:
        """Return the grid with the fence's cells occupied, within the grid's bounds."""
        cells = grid.frame.cells_from_metres(self._points)
        cells = cells[grid.frame.contains(cells)]
        if len(cells) == 0:
            return grid
        log_odds = np.array(grid.log_odds)
        log_odds[tuple(cells.T)] = OCCUPIED
        return OccupancyGrid(grid.frame, log_odds)

    def add_to_points(self, seen: NDArray[np.float64], world_from_base: SE2) -> NDArray[np.float64]:
        """Append the points of the fence (M, 2) to the ``seen`` points (N, 2), all in the base frame [m]."""
        if len(self._points) == 0:
            return seen
        return np.concatenate((seen, world_from_base.inverse().apply(self._points)))


def _points(start: NDArray[np.float64], end: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    count = max(1, math.ceil(math.dist(start, end) / spacing))
    points: NDArray[np.float64] = start + (end - start) * (np.arange(count) / count)[:, None]
    return points
