"""Plan paths on the robot's own map."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.graph import MCP_Geometric

from mapping.grid.occupancy_grid import OccupancyGrid
from sim.navigation.settings import RouteSettings


class Routes:
    """Plan the cheapest paths from ``start`` (2,) [m] over the grid's free cells for a robot of ``radius`` [m].

    Walls are inflated by the radius and one cell; unknown cells are blocked. ``costs`` (rows, cols) holds the path cost
    to each cell [m], increased near walls, and +inf for unreachable cells.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        start: NDArray[np.float64],
        radius: float,
        settings: RouteSettings = RouteSettings(),
    ) -> None:
        self.frame = grid.frame
        resolution = grid.frame.resolution
        if grid.occupied.any():
            to_wall = ndimage.distance_transform_edt(~grid.occupied) * resolution
        else:
            to_wall = np.full(grid.frame.shape, math.inf)
        price = 1.0 + settings.wall_cost * np.maximum(0.0, 1.0 - to_wall / settings.wall_distance)
        open_cells = grid.free & ((to_wall > radius + resolution) | (grid.free & _disc(grid, start, settings.escape)))
        start_cell = np.clip(grid.frame.cells_from_metres(start), 0, np.array(grid.frame.shape) - 1)
        open_cells[tuple(start_cell)] = True
        self._search = MCP_Geometric(np.where(open_cells, price, -1.0))
        costs, _ = self._search.find_costs([tuple(start_cell.tolist())])
        self.costs: NDArray[np.float64] = costs * resolution

    def path_to(self, cell: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the path from the start to a reachable cell (2,), as points in the map (N, 2) [m]."""
        return self.frame.metres_from_cells(self._search.traceback(tuple(cell.tolist())))


def _disc(grid: OccupancyGrid, centre: NDArray[np.float64], radius: float) -> NDArray[np.bool_]:
    cell = grid.frame.cells_from_metres(centre)
    reach = radius / grid.frame.resolution
    rows, cols = np.ogrid[: grid.frame.shape[0], : grid.frame.shape[1]]
    inside: NDArray[np.bool_] = (rows - cell[0]) ** 2 + (cols - cell[1]) ** 2 <= reach**2
    return inside
