"""The true raster of a world."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.frame import GridFrame
from mapping.grid import FREE, OCCUPIED, OccupancyGrid
from mapping.se2 import SE2
from worlds.polygon import Polygon, edges
from worlds.world import World

SNAP_CELLS = 1e-9
"""Corners this near to a cell's border count as on it, so that a wall drawn on the raster fills its own cells only."""


def true_raster(world: World, resolution: float = 0.05) -> OccupancyGrid:
    """The world as a fully known grid of ``resolution`` [m/cell] whose cell (0, 0) starts at the world's origin.

    A cell is occupied if any part of its inside is solid (any touch, as a lidar's hits would mark it), else free;
    a solid that only meets the cell's border does not count.

    Raises ``ValueError`` where the resolution is not positive and finite.
    """
    if not (math.isfinite(resolution) and resolution > 0.0):
        raise ValueError(f"true_raster: resolution is {resolution}, must be positive and finite")
    width, height = world.size
    shape = (math.ceil(height / resolution - SNAP_CELLS), math.ceil(width / resolution - SNAP_CELLS))
    solid = np.zeros(shape, dtype=np.bool_)
    for polygon in world.obstacles:
        corners = _snapped(polygon / resolution)
        _mark_inside(solid, corners)
        for start, end in edges(corners):
            _mark_crossed(solid, start, end)
    return OccupancyGrid.from_occupancy(
        GridFrame(resolution, SE2.identity(), shape), np.where(solid, OCCUPIED, FREE).astype(np.int8)
    )


def _snapped(cells: NDArray[np.float64]) -> NDArray[np.float64]:
    nearest = np.round(cells)
    return np.where(np.abs(cells - nearest) < SNAP_CELLS, nearest, cells)


def _mark_crossed(solid: NDArray[np.bool_], start: NDArray[np.float64], end: NDArray[np.float64]) -> None:
    """Mark the cells whose inside the segment passes: column by column, the rows between its entry and exit."""
    (x0, y0), (x1, y1) = (start, end) if start[0] <= end[0] else (end, start)
    first, stop = math.floor(x0 + SNAP_CELLS), math.ceil(x1 - SNAP_CELLS)
    columns = np.arange(max(first, 0), min(stop, solid.shape[1]))
    if columns.size == 0:
        return
    slope = (y1 - y0) / (x1 - x0) if x1 > x0 else 0.0
    entry = np.where(columns <= x0, y0, y0 + slope * (columns - x0))
    leave = np.where(columns + 1 >= x1, y1, y0 + slope * (columns + 1 - x0))
    low = np.floor(np.minimum(entry, leave) + SNAP_CELLS).astype(np.int64)
    high = np.ceil(np.maximum(entry, leave) - SNAP_CELLS).astype(np.int64)
    for column, row0, row1 in zip(columns, low, high, strict=True):
        solid[max(row0, 0) : max(row1, 0), column] = True


def _mark_inside(solid: NDArray[np.bool_], corners: Polygon) -> None:
    """Mark the cells whose centre lies inside, row by row: each side flips what lies right of where it crosses."""
    low = np.clip(np.floor(corners.min(axis=0)), 0, solid.shape[::-1]).astype(np.int64)
    high = np.clip(np.ceil(corners.max(axis=0)), 0, solid.shape[::-1]).astype(np.int64)
    flips = np.zeros((high[1] - low[1], high[0] - low[0] + 1), dtype=np.int64)
    for (x0, y0), (x1, y1) in edges(corners):
        bottom, top = sorted((y0, y1))
        rows = np.arange(max(math.ceil(bottom - 0.5), low[1]), min(math.ceil(top - 0.5), high[1]))
        if rows.size == 0:
            continue
        crossing_x = x0 + (rows + 0.5 - y0) * (x1 - x0) / (y1 - y0)
        columns = np.clip(np.ceil(crossing_x - 0.5), low[0], high[0]).astype(np.int64)
        flips[rows - low[1], columns - low[0]] += 1
    inside = np.cumsum(flips, axis=1)[:, :-1] % 2 == 1
    solid[low[1] : high[1], low[0] : high[0]] |= inside
