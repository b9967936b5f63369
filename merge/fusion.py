"""Several maps in one grid."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mapping.frame import GridFrame
from mapping.grid import SMALLEST_MISS, OccupancyGrid
from mapping.resampling import resampled
from mapping.se2 import SE2
from mapping.similarity2 import Similarity2

ROUNDING_CELLS = 1e-6

SAMPLES = 2
"""Points a side at which a merged cell looks up each map: no transform is known finer than half a cell."""


def fuse(reference: GridFrame, grids: Sequence[tuple[Similarity2, OccupancyGrid]]) -> OccupancyGrid:
    """Add up the log-odds of maps, each with its ``reference_from_map``, in the reference's frame and resolution.

    Independent evidence adds in log-odds (Moravec 1988). The grid is the reference's, with its cells and its origin's
    yaw, grown by whole cells to hold all maps; each map is looked up there by :func:`mapping.resampling.resampled`, so
    that thin walls of finer maps stay.
    """
    frame = _grown(reference, [_corners(reference_from_map, grid) for reference_from_map, grid in grids])
    total = np.zeros(frame.shape, dtype=np.float32)
    known = np.zeros(frame.shape, dtype=bool)
    for reference_from_map, grid in grids:
        seen = resampled(grid, reference_from_map, frame, SAMPLES)
        total += seen
        known |= seen != 0.0
    total[known & (total == 0.0)] = SMALLEST_MISS
    return OccupancyGrid(frame, total)


def _corners(reference_from_map: Similarity2, grid: OccupancyGrid) -> NDArray[np.float64]:
    rows, cols = grid.frame.shape
    outer = np.array([(0, 0), (0, cols), (rows, 0), (rows, cols)]) - 0.5  # the corner of a cell, not its centre
    return reference_from_map.apply(grid.frame.metres_from_cells(outer))


def _grown(reference: GridFrame, corners: Sequence[NDArray[np.float64]]) -> GridFrame:
    local = reference.origin.inverse().apply(np.concatenate(corners)) / reference.resolution
    rows, cols = reference.shape
    left, low = (min(0, math.floor(value + ROUNDING_CELLS)) for value in local.min(axis=0))
    right, high = (math.ceil(value - ROUNDING_CELLS) for value in local.max(axis=0))
    right, high = max(cols, right), max(rows, high)
    corner = reference.origin @ SE2(left * reference.resolution, low * reference.resolution)
    return GridFrame(reference.resolution, corner, (high - low, right - left))
