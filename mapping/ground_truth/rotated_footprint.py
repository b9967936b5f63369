"""A footprint turned about a cell of its own, to whole cells."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.ground_truth.footprint_layers import NEITHER, FootprintLayers


@dataclass(frozen=True, eq=False)
class RotatedFootprint:
    """``walls`` (N, 2) row, col, each once, and what each cell ``says`` (rows, cols), in cells of a canvas in whose
    cell ``centre`` (row, col) lies the cell that the footprint was turned about."""

    walls: NDArray[np.int64]
    says: NDArray[np.uint8]
    centre: tuple[int, int]


class FootprintRotation:
    """Turns one footprint about its coarse cell ``centre`` (2,) row, col."""

    def __init__(self, layers: FootprintLayers, centre: NDArray[np.int64]) -> None:
        self._says = layers.says
        self._centre = centre - layers.corner
        self._walls = layers.walls - centre
        self._outline = layers.outline() - centre
        self.reach = math.ceil(float(np.hypot(*self._outline.T).max())) + 1
        side = 2 * self.reach + 1
        self._canvas = np.zeros((side, side), np.bool_)

    def turned(self, angle: float) -> RotatedFootprint:
        """Turned counter-clockwise by an angle [rad], with an empty cell all around it."""
        c, s = math.cos(angle), math.sin(angle)
        y, x = self._outline.T
        ends = np.stack((s * x + c * y, c * x - s * y))
        low = np.maximum(np.floor(ends.min(axis=1)).astype(np.int64) - 2, -self.reach) + self.reach
        high = np.minimum(np.ceil(ends.max(axis=1)).astype(np.int64) + 2, self.reach) + self.reach
        row, col = self._centre
        matrix = np.array([[c, -s, self.reach - c * col + s * row], [s, c, self.reach - s * col - c * row]])
        side = 2 * self.reach + 1
        says = cv2.warpAffine(self._says, matrix, (side, side), flags=cv2.INTER_NEAREST, borderValue=NEITHER)
        walls = _turned_cells(self._walls, c, s, self.reach, self._canvas) - low
        centre = (self.reach - int(low[0]), self.reach - int(low[1]))
        return RotatedFootprint(walls, np.asarray(says[low[0] : high[0] + 1, low[1] : high[1] + 1], np.uint8), centre)


@njit(cache=True)
def _turned_cells(
    cells: NDArray[np.int64], c: float, s: float, middle: int, canvas: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Cells (N, 2) about the origin, turned to (M, 2), each once, about ``middle``; ``canvas`` is False before and
    after."""
    turned = np.empty_like(cells)
    count = 0
    for k in range(cells.shape[0]):
        y, x = cells[k, 0], cells[k, 1]
        i, j = round(s * x + c * y) + middle, round(c * x - s * y) + middle
        if not canvas[i, j]:
            canvas[i, j] = True
            turned[count, 0], turned[count, 1] = i, j
            count += 1
    for k in range(count):
        canvas[turned[k, 0], turned[k, 1]] = False
    return turned[:count]
