"""True footprints in coarse cells, as the search for ambiguous placements compares them, and their rotations."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.wall_agreement import HIT, MISS, NEUTRAL

COARSE_RESOLUTION = 0.2
"""Cell size of the search [m]: finer than the tolerance, and coarse enough to search all rotations and shifts."""

TOLERANCE = 0.3
"""Walls closer than this match; walls deeper than this in free space contradict [m]."""


@dataclass(frozen=True, eq=False)
class CoarseFootprint:
    """``walls`` (N, 2) row, col of the coarse cells that hold any wall; ``labels`` (rows, cols) uint8 of all cells.

    Labels are ``MISS``, ``NEUTRAL`` or ``HIT``, cropped to cells that are not neutral. Their first cell is row, col
    ``corner`` of the raster.
    """

    walls: NDArray[np.int64]
    labels: NDArray[np.uint8]
    corner: NDArray[np.int64]

    @staticmethod
    def of(footprint: OccupancyGrid) -> CoarseFootprint:
        """Label the coarse cells of a true raster that is unknown where the robot saw nothing."""
        step = round(COARSE_RESOLUTION / footprint.frame.resolution)
        window = _window(footprint.known, round(TOLERANCE / footprint.frame.resolution) + step, step)
        first = np.array([window[0].start, window[1].start]) // step
        occupied, free = footprint.occupied[window], footprint.free[window]
        if not occupied.any():
            return CoarseFootprint(np.zeros((0, 2), np.int64), np.zeros((0, 0), np.uint8), first)
        fine = footprint.frame.resolution
        miss = _block_means(_distance(free) * fine > TOLERANCE, step) > 0.5
        hit = _block_means(_distance(~occupied) * fine <= TOLERANCE, step) > 0.5
        walls = _block_means(occupied, step) > 0.0
        labels = np.where(hit, HIT, np.where(miss, MISS, NEUTRAL)).astype(np.uint8)
        rows, cols = np.nonzero(walls | (labels != NEUTRAL))
        low, high = np.array([rows.min(), cols.min()]), np.array([rows.max(), cols.max()]) + 1
        cropped = labels[low[0] : high[0], low[1] : high[1]].copy()
        return CoarseFootprint(np.argwhere(walls) + first, cropped, low + first)

    def outline(self) -> NDArray[np.int64]:
        """Return cells (N, 2) row, col whose convex hull holds every wall and every cell that is not neutral."""
        cells = np.concatenate((np.argwhere(self.labels != NEUTRAL) + self.corner, self.walls))
        cells = cells[np.lexsort((cells[:, 1], cells[:, 0]))]
        turns = np.flatnonzero(np.diff(cells[:, 0]))
        ends: NDArray[np.int64] = cells[np.unique(np.concatenate(([0], turns, turns + 1, [len(cells) - 1])))]
        return ends


@dataclass(frozen=True, eq=False)
class RotatedFootprint:
    """``walls`` (N, 2) row, col, each once, and ``labels`` (rows, cols); ``centre`` is the cell of the rotation."""

    walls: NDArray[np.int64]
    labels: NDArray[np.uint8]
    centre: tuple[int, int]


class FootprintRotation:
    """Rotate one footprint about its coarse cell ``centre`` (2,) row, col, to whole cells."""

    def __init__(self, footprint: CoarseFootprint, centre: NDArray[np.int64]) -> None:
        self._labels = footprint.labels
        self._centre = centre - footprint.corner
        self._walls = footprint.walls - centre
        self._outline = footprint.outline() - centre
        self.reach = math.ceil(float(np.hypot(*self._outline.T).max())) + 1
        side = 2 * self.reach + 1
        self._canvas = np.zeros((side, side), np.bool_)

    def rotated(self, angle: float) -> RotatedFootprint:
        """Rotate counter-clockwise by an angle [rad]; the result has a neutral cell all around it."""
        c, s = math.cos(angle), math.sin(angle)
        y, x = self._outline.T
        ends = np.stack((s * x + c * y, c * x - s * y))
        low = np.maximum(np.floor(ends.min(axis=1)).astype(np.int64) - 2, -self.reach) + self.reach
        high = np.minimum(np.ceil(ends.max(axis=1)).astype(np.int64) + 2, self.reach) + self.reach
        row, col = self._centre
        matrix = np.array([[c, -s, self.reach - c * col + s * row], [s, c, self.reach - s * col - c * row]])
        side = 2 * self.reach + 1
        labels = cv2.warpAffine(self._labels, matrix, (side, side), flags=cv2.INTER_NEAREST, borderValue=NEUTRAL)
        walls = _rotated_cells(self._walls, c, s, self.reach, self._canvas) - low
        centre = (self.reach - int(low[0]), self.reach - int(low[1]))
        window = labels[low[0] : high[0] + 1, low[1] : high[1] + 1]
        return RotatedFootprint(walls, np.asarray(window, np.uint8), centre)


def _window(known: NDArray[np.bool_], margin: int, step: int) -> tuple[slice, slice]:
    """Select the known cells and a margin around them, from a multiple of ``step`` on."""
    rows, cols = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    if not rows.size:
        return np.s_[0:0, 0:0]
    row, col = (max(0, int(ends[0]) - margin) // step * step for ends in (rows, cols))
    return np.s_[row : int(rows[-1]) + margin + 1, col : int(cols[-1]) + margin + 1]


def _distance(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Measure from each cell of a mask to the nearest cell outside of it [cells]: roots of whole numbers, exactly."""
    approximate = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.sqrt(np.rint(np.square(approximate, dtype=np.float64)))


def _block_means(mask: NDArray[np.bool_], step: int) -> NDArray[np.float64]:
    """Return the fraction of each block of ``step`` x ``step`` cells that is set."""
    rows, cols = (-size % step for size in mask.shape)
    padded = np.pad(mask, ((0, rows), (0, cols)))
    blocks = padded.reshape(padded.shape[0] // step, step, padded.shape[1] // step, step)
    share: NDArray[np.float64] = blocks.mean(axis=(1, 3))
    return share


@njit(cache=True)
def _rotated_cells(
    cells: NDArray[np.int64], c: float, s: float, middle: int, canvas: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Rotate cells (N, 2) about the origin to (M, 2) about ``middle``, each once; ``canvas`` is False before and
    after."""
    rotated = np.empty_like(cells)
    count = 0
    for k in range(cells.shape[0]):
        y, x = cells[k, 0], cells[k, 1]
        i, j = round(s * x + c * y) + middle, round(c * x - s * y) + middle
        if not canvas[i, j]:
            canvas[i, j] = True
            rotated[count, 0], rotated[count, 1] = i, j
            count += 1
    for k in range(count):
        canvas[rotated[k, 0], rotated[k, 1]] = False
    return rotated[:count]
