"""Thickness of the walls of a picture, from which the sizes of the steps follow."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from merge.literature.chen2021.binarisation import Image

GAP_CELLS = 3
"""Side of the closing that bridges single missing cells before walls are measured."""

THICK_SHARE = 0.9


@dataclass(frozen=True)
class WallThickness:
    """Thickness of a picture's walls [pixels], at least 1: the ``usual`` one, and the 90 % quantile ``thick``."""

    usual: int
    thick: int


def wall_thickness(walls: Image) -> WallThickness:
    """Measure straightened walls by the shorter of the two runs through each pixel; 1 where there is none."""
    mended = np.asarray(cv2.morphologyEx(walls, cv2.MORPH_CLOSE, np.ones((GAP_CELLS, GAP_CELLS), np.uint8)), np.uint8)
    across = np.minimum(run_lengths(mended), run_lengths(np.ascontiguousarray(mended.T)).T)
    thickness = np.sort(across[mended > 0])
    if not thickness.size:
        return WallThickness(1, 1)
    length = np.cumsum(1.0 / thickness)  # a wall of thickness t has t pixels for each of its length
    usual, thick = thickness[np.searchsorted(length, np.array([0.5, THICK_SHARE]) * length[-1])]
    return WallThickness(int(usual), int(thick))


@njit(cache=True)
def run_lengths(walls: NDArray[np.uint8]) -> NDArray[np.int32]:
    """Return the length of the run of wall pixels through each pixel along its row; 0 outside walls."""
    lengths = np.zeros(walls.shape, np.int32)
    for row in range(walls.shape[0]):
        start = 0
        for col in range(walls.shape[1] + 1):
            if col == walls.shape[1] or walls[row, col] == 0:
                lengths[row, start:col] = col - start
                start = col + 1
    return lengths
