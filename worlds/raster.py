"""Rasterize worlds."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from worlds.polygon import Polygon, edges
from worlds.world import World

SNAP_CELLS = 1e-9
"""Corners this near to a cell's border [cells] count as on it, so that a wall aligned with the raster fills only its
own cells."""


def true_raster(world: World, resolution: float = 0.05) -> OccupancyGrid:
    """Rasterize a world as a fully known grid of ``resolution`` [m/cell]; cell (0, 0) starts at the world's origin.

    A cell is occupied if any part of its inside is solid, and free otherwise. A solid that only touches the cell's
    border does not count. Raises ``ValueError`` if the resolution is not positive and finite.
    """
    if not (math.isfinite(resolution) and resolution > 0.0):
        raise ValueError(f"true_raster: resolution is {resolution}, must be positive and finite")
    width, height = world.size
    shape = (math.ceil(height / resolution - SNAP_CELLS), math.ceil(width / resolution - SNAP_CELLS))
    solid = touched_cells(world.obstacles, resolution, shape)
    return OccupancyGrid.from_occupancy(
        GridFrame(resolution, SE2.identity(), shape), np.where(solid, OCCUPIED, FREE).astype(np.int8)
    )


def touched_cells(polygons: Sequence[Polygon], resolution: float, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the cells (rows, cols) of ``resolution`` [m/cell] from the origin that a polygon fills at least partly."""
    if not polygons:
        return np.zeros(shape, dtype=np.bool_)
    sides = np.concatenate([edges(_snapped(polygon / resolution)) for polygon in polygons])
    return _crossed(sides, shape) | _inside(sides, shape)


def _snapped(cells: NDArray[np.float64]) -> NDArray[np.float64]:
    nearest = np.round(cells)
    return np.where(np.abs(cells - nearest) < SNAP_CELLS, nearest, cells)


def _crossed(sides: NDArray[np.float64], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the cells whose inside is crossed by a side (M, 2, 2) in cells: per column, the rows between entry and
    exit."""
    forward = sides[:, 0, 0] <= sides[:, 1, 0]
    x0, y0 = np.where(forward[:, None], sides[:, 0], sides[:, 1]).T
    x1, y1 = np.where(forward[:, None], sides[:, 1], sides[:, 0]).T
    first = np.maximum(np.floor(x0 + SNAP_CELLS).astype(np.int64), 0)
    stop = np.minimum(np.ceil(x1 - SNAP_CELLS).astype(np.int64), shape[1])
    side, column = _ranges(first, stop)
    slope = np.divide(y1 - y0, x1 - x0, out=np.zeros(len(sides)), where=x1 > x0)[side]
    x0, y0, x1, y1 = (values[side] for values in (x0, y0, x1, y1))
    entry = np.where(column <= x0, y0, y0 + slope * (column - x0))
    leave = np.where(column + 1 >= x1, y1, y0 + slope * (column + 1 - x0))
    low = np.clip(np.floor(np.minimum(entry, leave) + SNAP_CELLS).astype(np.int64), 0, shape[0])
    high = np.clip(np.ceil(np.maximum(entry, leave) - SNAP_CELLS).astype(np.int64), 0, shape[0])
    some = low < high
    counts = np.zeros((shape[0] + 1, shape[1]), dtype=np.int32)
    np.add.at(counts, (low[some], column[some]), 1)
    np.add.at(counts, (high[some], column[some]), -1)
    return np.asarray(np.cumsum(counts, axis=0)[:-1] > 0)


def _inside(sides: NDArray[np.float64], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the cells whose centre lies inside a polygon: along +x, a side that runs down enters it, one that runs up
    leaves it."""
    (x0, y0), (x1, y1) = sides.transpose(1, 2, 0)
    bottom, top = np.minimum(y0, y1), np.maximum(y0, y1)
    first = np.maximum(np.ceil(bottom - 0.5).astype(np.int64), 0)
    stop = np.minimum(np.ceil(top - 0.5).astype(np.int64), shape[0])
    side, row = _ranges(first, stop)
    x0, y0, x1, y1 = (values[side] for values in (x0, y0, x1, y1))
    crossing_x = x0 + (row + 0.5 - y0) * (x1 - x0) / (y1 - y0)
    column = np.clip(np.ceil(crossing_x - 0.5).astype(np.int64), 0, shape[1])
    depth = np.zeros((shape[0], shape[1] + 1), dtype=np.int32)
    np.add.at(depth, (row, column), np.where(y0 > y1, 1, -1))
    return np.asarray(np.cumsum(depth, axis=1)[:, :-1] > 0)


def _ranges(first: NDArray[np.int64], stop: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Concatenate the ranges ``first[i]`` to ``stop[i]``: returns the index i and the number of each element."""
    count = np.maximum(stop - first, 0)
    which = np.repeat(np.arange(len(first)), count)
    number = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count) + first[which]
    return which, number
