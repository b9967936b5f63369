"""Find frontiers of the known floor, and the unknown area visible from them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mapping.grid.occupancy_grid import OccupancyGrid
from sim.navigation.routes import Routes

MIN_CELLS = 3
"""Frontiers of fewer cells are gaps between beams."""
MAX_FRONTIERS = 40
VIEW = 4.0
"""Radius within which unknown floor counts as visible [m]."""
FROM_FRONTIER = 1.0
"""Greatest distance of a viewpoint from its frontier [m]."""

_DIRECTIONS = 48


@dataclass(frozen=True, eq=False)
class Viewpoints:
    """Hold N viewpoints: ``cells`` (N, 2) rows of row, col, the ``gain`` (N,) [m^2] of visible unknown floor, and the
    path ``cost`` (N,) [m]."""

    cells: NDArray[np.int64]
    gain: NDArray[np.float64]
    cost: NDArray[np.float64]


def viewpoints(grid: OccupancyGrid, routes: Routes) -> Viewpoints:
    """Find one viewpoint per reachable frontier: the reachable cell nearest to the frontier's centre.

    A frontier is a connected set of free cells next to unknown ones (Yamauchi, "A frontier-based approach for
    autonomous exploration", CIRA 1997) and not next to walls.
    """
    middles = _frontier_middles(grid)
    reachable = np.isfinite(routes.costs)
    away, nearest = ndimage.distance_transform_edt(~reachable, return_indices=True)
    near = away[tuple(middles.T)] * grid.frame.resolution <= FROM_FRONTIER
    cells = np.unique(nearest[:, middles[near, 0], middles[near, 1]].T, axis=0).astype(np.int64).reshape(-1, 2)
    return Viewpoints(cells, visible_unknown(grid, cells), routes.costs[tuple(cells.T)])


def visible_unknown(grid: OccupancyGrid, cells: NDArray[np.int64]) -> NDArray[np.float64]:
    """Compute the unknown area [m^2] visible within 4 m of each cell (N, 2), with known walls as occluders: (N,).

    Cells outside the grid count as unknown.
    """
    step = grid.frame.resolution
    angles = math.tau * np.arange(_DIRECTIONS) / _DIRECTIONS
    reaches = np.arange(1, int(VIEW / step) + 1)
    rays = np.stack((np.sin(angles), np.cos(angles)), axis=-1)[:, None] * reaches[:, None]
    seen = cells[:, None, None] + np.rint(rays).astype(np.int64)
    rows, cols = np.moveaxis(np.clip(seen, 0, np.array(grid.frame.shape) - 1), -1, 0)
    inside = grid.frame.contains(seen)
    blocked = np.logical_or.accumulate(grid.occupied[rows, cols] & inside, axis=2)
    unknown = (~grid.known[rows, cols] | ~inside) & ~blocked
    cell_area = reaches * step * (math.tau / _DIRECTIONS) * step
    area: NDArray[np.float64] = (unknown * cell_area).sum(axis=(1, 2))
    return area


def _frontier_middles(grid: OccupancyGrid) -> NDArray[np.int64]:
    """Return the cell nearest to the centroid of each frontier (N, 2), the largest frontier first."""
    eight = np.ones((3, 3), dtype=np.bool_)
    border = grid.free & ndimage.binary_dilation(~grid.known) & ~ndimage.binary_dilation(grid.occupied, eight)
    labels, count = ndimage.label(border, structure=eight)
    cells = np.argwhere(border)
    names = labels[border]
    sizes = np.bincount(names, minlength=count + 1)
    large = np.argsort(-sizes, kind="stable")[:MAX_FRONTIERS]
    middles = []
    for name in large[sizes[large] >= MIN_CELLS]:
        members = cells[names == name]
        middles.append(members[np.argmin(((members - members.mean(axis=0)) ** 2).sum(axis=1))])
    return np.array(middles, dtype=np.int64).reshape(-1, 2)
