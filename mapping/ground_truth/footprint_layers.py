"""A true footprint as the search for second placements sees it: walls, what is near them, and deep free space."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.grid.occupancy_grid import OccupancyGrid

COARSE_RESOLUTION = 0.2
"""Cell size of the search [m]."""

TOLERANCE = 0.3
"""Walls closer than this agree; walls deeper than this in free space contradict [m]."""

DEEP, NEITHER, NEAR = 0, 1, 2
"""What a coarse cell says of a wall laid on it: a contradiction, nothing, a hit. A larger value never agrees worse."""


@dataclass(frozen=True, eq=False)
class FootprintLayers:
    """``walls`` (N, 2) row, col of coarse cells that hold any wall; ``says`` (rows, cols) uint8 ``DEEP``,
    ``NEITHER`` or ``NEAR``, cut to what says anything, its first cell at row, col ``corner``."""

    walls: NDArray[np.int64]
    says: NDArray[np.uint8]
    corner: NDArray[np.int64]

    @staticmethod
    def of(footprint: OccupancyGrid) -> FootprintLayers:
        """The layers of a true raster that is unknown where the robot saw nothing."""
        step = round(COARSE_RESOLUTION / footprint.frame.resolution)
        window = _window(footprint.known, round(TOLERANCE / footprint.frame.resolution) + step, step)
        first = np.array([window[0].start, window[1].start]) // step
        occupied, free = footprint.occupied[window], footprint.free[window]
        if not occupied.any():
            return FootprintLayers(np.zeros((0, 2), np.int64), np.zeros((0, 0), np.uint8), first)
        fine = footprint.frame.resolution
        deep = _pool(_distance(free) * fine > TOLERANCE, step) > 0.5
        near = _pool(_distance(~occupied) * fine <= TOLERANCE, step) > 0.5
        walls = _pool(occupied, step) > 0.0
        says = np.where(near, NEAR, np.where(deep, DEEP, NEITHER)).astype(np.uint8)
        rows, cols = np.nonzero(walls | (says != NEITHER))
        low, high = np.array([rows.min(), cols.min()]), np.array([rows.max(), cols.max()]) + 1
        return FootprintLayers(np.argwhere(walls) + first, says[low[0] : high[0], low[1] : high[1]].copy(), low + first)

    def outline(self) -> NDArray[np.int64]:
        """Row, col of cells (N, 2) whose convex hull holds every cell that says anything, and every wall."""
        cells = np.argwhere(self.says != NEITHER) + self.corner
        return _row_ends(np.concatenate((cells, self.walls)))


def _window(known: NDArray[np.bool_], margin: int, step: int) -> tuple[slice, slice]:
    """The known cells and a margin around them, from a multiple of ``step`` on."""
    rows, cols = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    if not rows.size:
        return np.s_[0:0, 0:0]
    row, col = (max(0, int(ends[0]) - margin) // step * step for ends in (rows, cols))
    return np.s_[row : int(rows[-1]) + margin + 1, col : int(cols[-1]) + margin + 1]


def _distance(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """From each cell of the mask to the nearest cell outside of it [cells]: roots of whole numbers, exactly."""
    approximate = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.sqrt(np.rint(np.square(approximate, dtype=np.float64)))


def _pool(mask: NDArray[np.bool_], step: int) -> NDArray[np.float64]:
    """The share of each block of ``step`` x ``step`` cells that is set."""
    rows, cols = (-size % step for size in mask.shape)
    padded = np.pad(mask, ((0, rows), (0, cols)))
    blocks = padded.reshape(padded.shape[0] // step, step, padded.shape[1] // step, step)
    share: NDArray[np.float64] = blocks.mean(axis=(1, 3))
    return share


def _row_ends(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """The first and the last cell of each row."""
    cells = cells[np.lexsort((cells[:, 1], cells[:, 0]))]
    turns = np.flatnonzero(np.diff(cells[:, 0]))
    ends: NDArray[np.int64] = cells[np.unique(np.concatenate(([0], turns, turns + 1, [len(cells) - 1])))]
    return ends
