"""Fusion of several maps into one grid, and their conflicts."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mapping.arrays import sealed
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import SMALLEST_MISS, TRINARY_LOG_ODDS, OccupancyGrid
from mapping.grid.resampling import Resampling
from mapping.validation import require_valid

ROUNDING_CELLS = 1e-3
"""A map reaches into a cell if it does so by more [cells]. Messages of ROS round the cell size to float32: after 10,000
cells of 0.05 m a raster is then wrong by 2e-4 cells."""

ONE_WALL_CELLS = 1.5
"""Distance of cells that belong to one wall [cells]: they touch, if only by a corner."""

FusionName = Literal["log_odds", "least_entropy", "max"]
FUSIONS: tuple[FusionName, ...] = get_args(FusionName)

Raster = NDArray[np.float32]


@dataclass(frozen=True)
class FusionSettings:
    """The grid of a merged map.

    - ``samples``: points a side at which a merged cell looks up each map; no transform is known finer than half a cell;
    - ``max_cells``: cells are made wider where a merged map would have more;
    - ``same_wall_cells``: largest distance [cells] of two maps' drawings of one wall; 0.3 m in cells of 0.05 m, about
      the drift of a map that still merges, and less than the width of a door;
    - ``band_rows``: rows that are fused at a time, to save memory; any number gives the same map;
    - ``tie_log_odds``: of the drawings of a wall, those whose log-odds are within this of the best are all kept; less
      than one observation changes.
    """

    samples: int = 2
    max_cells: int = 2**26
    band_rows: int = 256
    same_wall_cells: float = 6.0
    tie_log_odds: float = 0.5

    def __post_init__(self) -> None:
        require_valid(self)


@dataclass(frozen=True, eq=False)
class Fused:
    """The merged map, and on the same cells the ``conflicts`` of its maps.

    A cell is occupied if one map shows a wall deep in the free space of another, free if two or more maps know it and
    agree, and unknown otherwise. ``doubled_walls`` is the share of the walls that several maps show which the merged
    map shows more than once, because the maps lie too far apart there.
    """

    merged: OccupancyGrid
    conflicts: OccupancyGrid
    doubled_walls: float


def fuse(
    reference: GridFrame,
    grids: Sequence[tuple[Similarity2, OccupancyGrid]],
    fusion: FusionName = "log_odds",
    settings: FusionSettings = FusionSettings(),
) -> OccupancyGrid:
    """Fuse maps, each with its ``reference_from_map``, in the frame of the reference: see ``fuse_and_compare``."""
    return fuse_and_compare(reference, grids, fusion, settings).merged


def fuse_and_compare(
    reference: GridFrame,
    grids: Sequence[tuple[Similarity2, OccupancyGrid]],
    fusion: FusionName = "log_odds",
    settings: FusionSettings = FusionSettings(),
) -> Fused:
    """Fuse maps, each with its ``reference_from_map``, in the frame and resolution of the reference.

    - ``log_odds``: sum of the log-odds, right for independent evidence (Moravec 1988). Where maps lie more than a
      wall's thickness apart, the free cells of each erase the wall of the other; so a wall that several maps show and
      the sum loses is kept where the sum is best (``_lost_walls``);
    - ``least_entropy``: of a cell's probabilities and their mean, the one of least Shannon entropy (Chen 2021, appendix
      A). Entropy is concave, so the mean never has the least: the most certain map wins, and occupied if two are
      equally certain of opposites;
    - ``max``: the most occupied (m-explore).

    The order of the maps does not matter. The grid is the reference's, grown by whole cells to hold all maps. Each map
    is resampled so that thin walls of finer maps stay.
    """
    frame = _grown(
        reference, [_corners(reference_from_map, grid) for reference_from_map, grid in grids], settings.max_cells
    )
    total, conflicts = (np.zeros(frame.shape, dtype=np.float32) for _ in range(2))
    views = [_View.of(frame, reference_from_map, grid, settings.samples) for reference_from_map, grid in grids]
    shared = doubled = 0
    for first in range(0, frame.shape[0], settings.band_rows):
        rows = slice(first, min(first + settings.band_rows, frame.shape[0]))
        band = _fused_band(frame, views, rows, fusion, settings)
        for raster, cells in ((total, band.total), (conflicts, band.conflicts)):
            np.copyto(raster[rows], cells, where=cells != 0.0)  # so that unknown areas take no memory
        shared, doubled = shared + band.shared, doubled + band.doubled
    return Fused(OccupancyGrid(frame, sealed(total)), OccupancyGrid(frame, sealed(conflicts)), doubled / max(1, shared))


@dataclass(frozen=True, eq=False)
class _View:
    """A map seen on the rows and columns of the merged frame that it covers."""

    rows: slice
    cols: slice
    resampling: Resampling

    @staticmethod
    def of(frame: GridFrame, frame_from_map: Similarity2, grid: OccupancyGrid, samples: int) -> _View:
        rows, cols = _box(frame, _corners(frame_from_map, grid))
        window = frame.window((rows.start, cols.start), (rows.stop - rows.start, cols.stop - cols.start))
        return _View(rows, cols, Resampling(grid, frame_from_map, window, samples))


@dataclass(frozen=True, eq=False)
class _Band:
    """Some rows of the merged map: ``total`` and ``conflicts`` (rows, cols), and the numbers of wall cells that several
    maps show, and that the merged map shows more than once."""

    total: Raster
    conflicts: Raster
    shared: int
    doubled: int


def _fused_band(
    frame: GridFrame, views: Sequence[_View], rows: slice, fusion: FusionName, settings: FusionSettings
) -> _Band:
    """Fuse the rows of a band. Rows beside it decide with it: those within reach of a wall, twice (``_lost_walls``)."""
    halo = 2 * math.ceil(settings.same_wall_cells) + 3
    first, last = max(0, rows.start - halo), min(frame.shape[0], rows.stop + halo)
    shape = last - first, frame.shape[1]
    total, highest = (np.zeros(shape, dtype=np.float32) for _ in range(2))
    known, occupied = (np.zeros(shape, dtype=np.uint16) for _ in range(2))
    deep = np.zeros(shape, dtype=bool)
    nearest, second = (np.full(shape, np.inf, dtype=np.float16) for _ in range(2))
    for view in views:
        low, high = max(first, view.rows.start), min(last, view.rows.stop)
        if low >= high:
            continue
        box = slice(low - first, high - first), view.cols
        seen = view.resampling.rows(low - view.rows.start, high - view.rows.start)
        _RULES[fusion](total[box], seen, known[box] > 0)
        np.maximum(highest[box], seen, out=highest[box])
        known[box] += seen != 0.0
        occupied[box] += seen > 0.0
        deep[box] |= _inner(seen < 0.0)
        away = _distance(seen > 0.0)
        second[box] = np.minimum(second[box], np.maximum(nearest[box], away))
        nearest[box] = np.minimum(nearest[box], away)
    shared = (occupied > 0) & (second <= settings.same_wall_cells)
    if fusion == "log_odds":
        lost = _lost_walls(total, shared, second, settings)
        total[lost] = highest[lost]
    doubled = shared & deep & (total > 0.0) & (second > ONE_WALL_CELLS)
    total[(known > 0) & (total == 0.0)] = SMALLEST_MISS
    conflicts = np.where(known > 1, np.float32(-TRINARY_LOG_ODDS), np.float32(0.0))
    conflicts[deep & (occupied > 0)] = TRINARY_LOG_ODDS
    own = slice(rows.start - first, rows.stop - first)
    counts = (int(np.count_nonzero(mask[own])) for mask in (shared, doubled))
    return _Band(total[own], conflicts[own], *counts)


def _lost_walls(
    total: Raster, shared: NDArray[np.bool_], second: NDArray[np.float16], settings: FusionSettings
) -> NDArray[np.bool_]:
    """Select the cells to keep of walls that several maps show and the sum of their log-odds does not.

    ``shared`` are the cells where a map shows a wall of which another map shows a cell ``second`` cells away. Such a
    cell is lost if no wall of the sum lies as near. Of the lost cells around a place, those with the best sum are kept.
    """
    lost: NDArray[np.bool_] = shared & (_distance(total > 0.0) > second)
    if lost.any():
        reach = math.ceil(settings.same_wall_cells)
        sums = np.where(lost, total, np.float32(-np.inf))
        best = cv2.dilate(sums, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1)))
        lost &= sums >= best - settings.tie_log_odds
    return lost


def _distance(walls: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the distance of each cell to the nearest wall [cells]; infinite without walls."""
    if not walls.any():
        return np.full(walls.shape, np.inf, np.float32)
    distance = cv2.distanceTransform((~walls).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(distance, np.float32)


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
    """Erode the free cells, because walls that are one cell off are no conflict."""
    inner: NDArray[np.bool_] = ndimage.binary_erosion(free, np.ones((3, 3), bool))
    return inner


def finest(reference: GridFrame, resolutions: Sequence[float]) -> GridFrame:
    """Refine the reference frame to the finest of these resolutions, in its metres."""
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
    """Return the rows and columns of the frame that a map with these corners covers, and one more on each side."""
    cells = frame.origin.inverse().apply(corners) / frame.resolution
    low = np.maximum(np.floor(cells.min(axis=0)).astype(int) - 1, 0)
    high = np.minimum(np.ceil(cells.max(axis=0)).astype(int) + 1, frame.shape[::-1])
    return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))


def _grown(reference: GridFrame, corners: Sequence[NDArray[np.float64]], max_cells: int) -> GridFrame:
    local = reference.origin.inverse().apply(np.concatenate(corners)) / reference.resolution
    rows, cols = reference.shape
    left, low = (min(0, math.floor(value + ROUNDING_CELLS)) for value in local.min(axis=0))
    right, high = (math.ceil(value - ROUNDING_CELLS) for value in local.max(axis=0))
    right, high = max(cols, right), max(rows, high)
    corner = reference.origin @ SE2(left * reference.resolution, low * reference.resolution)
    grown = GridFrame(reference.resolution, corner, (high - low, right - left))
    cells = math.prod(grown.shape)
    if cells <= max_cells:
        return grown
    wider = math.sqrt(cells / max_cells)
    rows, cols = (math.ceil(side / wider) for side in grown.shape)
    return GridFrame(reference.resolution * wider, corner, (rows, cols))
