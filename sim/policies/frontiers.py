"""Find frontiers of the known floor, and the unknown area visible from them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mapping.grid.occupancy_grid import OccupancyGrid
from sim.navigation.routes import Routes
from sim.policies.settings import FrontierSettings

DEFAULTS = FrontierSettings()


@dataclass(frozen=True, eq=False)
class Viewpoints:
    """Hold N viewpoints: ``cells`` (N, 2) rows of row, col, the ``gain`` (N,) [m^2] of visible unknown floor, and the
    path ``cost`` (N,) [m]."""

    cells: NDArray[np.int64]
    gain: NDArray[np.float64]
    cost: NDArray[np.float64]


def viewpoints(grid: OccupancyGrid, routes: Routes, settings: FrontierSettings = DEFAULTS) -> Viewpoints:
    """Find one viewpoint per reachable frontier: the reachable cell nearest to the frontier's centre.

    A frontier is a connected set of free cells next to unknown ones (Yamauchi, "A frontier-based approach for
    autonomous exploration", CIRA 1997) and not next to walls.
    """
    middles = _frontier_middles(grid, settings)
    reachable = np.isfinite(routes.costs)
    away, nearest = ndimage.distance_transform_edt(~reachable, return_indices=True)
    near = away[tuple(middles.T)] * grid.frame.resolution <= settings.viewpoint_distance
    cells = np.unique(nearest[:, middles[near, 0], middles[near, 1]].T, axis=0).astype(np.int64).reshape(-1, 2)
    return Viewpoints(cells, visible_unknown(grid, cells, settings), routes.costs[tuple(cells.T)])


def visible_unknown(
    grid: OccupancyGrid, cells: NDArray[np.int64], settings: FrontierSettings = DEFAULTS
) -> NDArray[np.float64]:
    """Compute the unknown area [m^2] visible from each cell (N, 2), with known walls as occluders: (N,).

    Cells outside the grid count as unknown.
    """
    step, directions = grid.frame.resolution, settings.directions
    angles = math.tau * np.arange(directions) / directions
    reaches = np.arange(1, int(settings.view / step) + 1)
    rays = np.stack((np.sin(angles), np.cos(angles)), axis=-1)[:, None] * reaches[:, None]
    seen = cells[:, None, None] + np.rint(rays).astype(np.int64)
    rows, cols = np.moveaxis(np.clip(seen, 0, np.array(grid.frame.shape) - 1), -1, 0)
    inside = grid.frame.contains(seen)
    blocked = np.logical_or.accumulate(grid.occupied[rows, cols] & inside, axis=2)
    unknown = (~grid.known[rows, cols] | ~inside) & ~blocked
    cell_area = reaches * step * (math.tau / directions) * step
    area: NDArray[np.float64] = (unknown * cell_area).sum(axis=(1, 2))
    return area


def _frontier_middles(grid: OccupancyGrid, settings: FrontierSettings) -> NDArray[np.int64]:
    """Return the cell nearest to the centroid of each frontier (N, 2), the largest frontier first."""
    eight = np.ones((3, 3), dtype=np.bool_)
    border = grid.free & ndimage.binary_dilation(~grid.known) & ~ndimage.binary_dilation(grid.occupied, eight)
    labels, count = ndimage.label(border, structure=eight)
    cells = np.argwhere(border)
    names = labels[border]
    sizes = np.bincount(names, minlength=count + 1)
    large = np.argsort(-sizes, kind="stable")[: settings.max_frontiers]
    middles = []
    for name in large[sizes[large] >= settings.min_cells]:
        members = cells[names == name]
        middles.append(members[np.argmin(((members - members.mean(axis=0)) ** 2).sum(axis=1))])
    return np.array(middles, dtype=np.int64).reshape(-1, 2)
