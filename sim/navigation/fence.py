"""A fence that no lidar sees: robots know where it is and treat it as a wall."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.occupancy_grid import OccupancyGrid
from worlds.polygon import Polygon, edges

STEP = 0.05
"""Distance of the points that stand for the fence [m]."""
LOG_ODDS = 10.0


class Fence:
    """A fence for who plans and steers; an ``outline`` of None fences nothing in."""

    def __init__(self, outline: Polygon | None) -> None:
        pieces = [] if outline is None else [_points(start, end) for start, end in edges(outline)]
        self._points = np.concatenate(pieces) if pieces else np.empty((0, 2))

    def drawn_into(self, grid: OccupancyGrid) -> OccupancyGrid:
        """The grid with the fence's cells occupied, as far as it reaches."""
        cells = grid.frame.cells_from_metres(self._points)
        cells = cells[grid.frame.contains(cells)]
        if len(cells) == 0:
            return grid
        log_odds = np.array(grid.log_odds)
        log_odds[tuple(cells.T)] = LOG_ODDS
        return OccupancyGrid(grid.frame, log_odds)

    def beside(self, seen: NDArray[np.float64], world_from_base: SE2) -> NDArray[np.float64]:
        """The seen points, (N, 2), and after them those of the fence, (M, 2), all in base [m]."""
        if len(self._points) == 0:
            return seen
        return np.concatenate((seen, world_from_base.inverse().apply(self._points)))


def _points(start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
    count = max(1, math.ceil(math.dist(start, end) / STEP))
    points: NDArray[np.float64] = start + (end - start) * (np.arange(count) / count)[:, None]
    return points
