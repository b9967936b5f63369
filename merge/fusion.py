"""Several maps in one grid, and where they contradict one another."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import FREE, OCCUPIED, SMALLEST_MISS, UNKNOWN, OccupancyGrid
from mapping.grid.resampling import resampled

ROUNDING_CELLS = 1e-6

SAMPLES = 2
"""Points a side at which a merged cell looks up each map: no transform is known finer than half a cell."""

MOST_CELLS = 2**26
"""A merged map has no more cells: they are made wider where it would."""

FusionName = Literal["log_odds", "least_entropy", "max"]
FUSIONS: tuple[FusionName, ...] = get_args(FusionName)

Raster = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Fused:
    """The merged map, and on the same cells where its maps ``conflict``: occupied where one shows a wall deep in what
    another shows free, free where two or more know the cell and agree, unknown where fewer do."""

    merged: OccupancyGrid
    conflicts: OccupancyGrid


def fuse(
    reference: GridFrame, grids: Sequence[tuple[Similarity2, OccupancyGrid]], fusion: FusionName = "log_odds"
) -> OccupancyGrid:
    """Join maps, each with its ``reference_from_map``, in the reference's frame and resolution: see
    ``fuse_and_compare``."""
    return fuse_and_compare(reference, grids, fusion).merged


def fuse_and_compare(
    reference: GridFrame, grids: Sequence[tuple[Similarity2, OccupancyGrid]], fusion: FusionName = "log_odds"
) -> Fused:
    """Join maps, each with its ``reference_from_map``, in the reference's frame and resolution, in any order.

    - ``log_odds`` adds up evidence, which in log-odds is a sum where it is independent (Moravec 1988);
    - ``least_entropy`` keeps of a cell's probabilities, and their mean, that of least Shannon entropy (Chen 2021,
      appendix A). Entropy is concave, so the mean never has less than the surest: the surest map has its way, and
      occupied where two are as sure of opposites;
    - ``max`` keeps the most occupied (m-explore).

    The grid is the reference's, with its cells and its origin's yaw, grown by whole cells to hold all maps; each map is
    looked up there by ``resampled``, so that thin walls of finer maps stay.
    """
    frame = _grown(reference, [_corners(reference_from_map, grid) for reference_from_map, grid in grids])
    total = np.zeros(frame.shape, dtype=np.float32)
    known, occupied = (np.zeros(frame.shape, dtype=np.uint16) for _ in range(2))
    deep = np.zeros(frame.shape, dtype=bool)
    for reference_from_map, grid in grids:
        box = _box(frame, _corners(reference_from_map, grid))
        window = frame.window((box[0].start, box[1].start), total[box].shape)
        seen = resampled(grid, reference_from_map, window, SAMPLES)
        _RULES[fusion](total[box], seen, known[box] > 0)
        known[box] += seen != 0.0
        occupied[box] += seen > 0.0
        deep[box] |= _inner(seen < 0.0)
    total[(known > 0) & (total == 0.0)] = SMALLEST_MISS
    told = np.full(frame.shape, UNKNOWN, np.int8)
    told[known > 1] = FREE
    told[deep & (occupied > 0)] = OCCUPIED
    return Fused(OccupancyGrid(frame, total), OccupancyGrid.from_occupancy(frame, told))


def _add(total: Raster, seen: Raster, known: NDArray[np.bool_]) -> None:
    total += seen


def _surest(total: Raster, seen: Raster, known: NDArray[np.bool_]) -> None:
    surer = np.abs(seen) > np.abs(total)
    opposite = (np.abs(seen) == np.abs(total)) & (seen > total)
    np.copyto(total, seen, where=surer | opposite)


def _most_occupied(total: Raster, seen: Raster, known: NDArray[np.bool_]) -> None:
    np.copyto(total, seen, where=(seen != 0.0) & (~known | (seen > total)))


_RULES: dict[FusionName, Callable[[Raster, Raster, NDArray[np.bool_]], None]] = {
    "log_odds": _add,
    "least_entropy": _surest,
    "max": _most_occupied,
}


def _inner(free: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Free cells with nothing else around them: walls that lie a cell off are no conflict."""
    inner: NDArray[np.bool_] = ndimage.binary_erosion(free, np.ones((3, 3), bool))
    return inner


def finest(reference: GridFrame, resolutions: Sequence[float]) -> GridFrame:
    """The reference's raster, in cells as fine as the finest of these resolutions, in its metres."""
    resolution = min(reference.resolution, *resolutions) if resolutions else reference.resolution
    if resolution > reference.resolution * (1.0 - 1e-6):
        return reference
    rows, cols = (math.ceil(side * reference.resolution / resolution - ROUNDING_CELLS) for side in reference.shape)
    return GridFrame(resolution, reference.origin, (rows, cols))


def _corners(reference_from_map: Similarity2, grid: OccupancyGrid) -> NDArray[np.float64]:
    rows, cols = grid.frame.shape
    outer = np.array([(0, 0), (0, cols), (rows, 0), (rows, cols)]) - 0.5  # the corner of a cell, not its centre
    return reference_from_map.apply(grid.frame.metres_from_cells(outer))


def _box(frame: GridFrame, corners: NDArray[np.float64]) -> tuple[slice, slice]:
    """The rows and cols of the frame that a map with those corners lies on, and one more on each side."""
    cells = frame.origin.inverse().apply(corners) / frame.resolution
    low = np.maximum(np.floor(cells.min(axis=0)).astype(int) - 1, 0)
    high = np.minimum(np.ceil(cells.max(axis=0)).astype(int) + 1, frame.shape[::-1])
    return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))


def _grown(reference: GridFrame, corners: Sequence[NDArray[np.float64]]) -> GridFrame:
    local = reference.origin.inverse().apply(np.concatenate(corners)) / reference.resolution
    rows, cols = reference.shape
    left, low = (min(0, math.floor(value + ROUNDING_CELLS)) for value in local.min(axis=0))
    right, high = (math.ceil(value - ROUNDING_CELLS) for value in local.max(axis=0))
    right, high = max(cols, right), max(rows, high)
    corner = reference.origin @ SE2(left * reference.resolution, low * reference.resolution)
    grown = GridFrame(reference.resolution, corner, (high - low, right - left))
    cells = math.prod(grown.shape)
    if cells <= MOST_CELLS:
        return grown
    wider = math.sqrt(cells / MOST_CELLS)
    rows, cols = (math.ceil(side / wider) for side in grown.shape)
    return GridFrame(reference.resolution * wider, corner, (rows, cols))
