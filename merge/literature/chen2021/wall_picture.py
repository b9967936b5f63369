"""Steps 5.1 to 5.3 on a picture of walls: binarise, rotate, measure the thickness, close gaps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

Image = NDArray[np.uint8]
"""A picture (rows, cols) of two values, highest row first: ``WALL`` where there is wall, else 0."""

WALL = 255


def binarised(picture: Image, unknown_grey: int) -> Image:
    """Make the walls of a grey picture (rows, cols) white and all else black; walls are dark.

    Source: Chen 2021, section 5.1. Pixels darker than unknown are walls. A picture of three greys needs no threshold.
    """
    return np.where(picture < unknown_grey, WALL, 0).astype(np.uint8)


@dataclass(frozen=True, eq=False)
class Straightened:
    """The rotated picture, cropped to its walls and a margin.

    ``matrix`` (2, 3) maps pixels of the original picture to its own, centres at integers.
    """

    walls: Image
    matrix: NDArray[np.float64]

    def before(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map pixels (N, 2) of the rotated picture to the original picture."""
        return (pixels - self.matrix[:, 2]) @ self.matrix[:, :2]  # the inverse of a turn is its transpose


def straightened(walls: Image, angle: float, margin: int) -> Straightened:
    """Rotate the picture by ``-angle`` [rad, from u to v], so that walls along ``angle`` run along rows.

    ``margin`` pixels are left around the walls.

    Source: Chen 2021, section 5.2: enlarged canvas, bilinear, binarised again.
    """
    rows, cols = walls.shape
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, s], [-s, c]])
    corners = np.array([(0, 0), (cols - 1, 0), (0, rows - 1), (cols - 1, rows - 1)]) @ turn.T
    low = np.floor(corners.min(axis=0)) - 1.0
    width, height = (int(side) for side in np.ceil(corners.max(axis=0) - low) + 2.0)
    matrix = np.column_stack((turn, -low))
    turned = cv2.warpAffine(walls, matrix, (width, height), flags=cv2.INTER_LINEAR)
    return _cut(np.where(turned > WALL // 2, WALL, 0).astype(np.uint8), matrix, margin)


def _cut(walls: Image, matrix: NDArray[np.float64], margin: int) -> Straightened:
    rows, cols = np.flatnonzero(walls.any(axis=1)), np.flatnonzero(walls.any(axis=0))
    if not rows.size:
        return Straightened(walls, matrix)
    padded = np.pad(walls[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1], margin)
    corner = np.array([cols[0] - margin, rows[0] - margin], np.float64)
    return Straightened(padded, np.column_stack((matrix[:, :2], matrix[:, 2] - corner)))


@dataclass(frozen=True)
class WallThickness:
    """Thickness of a picture's walls [pixels], at least 1: the ``usual`` one, and a high quantile ``thick``."""

    usual: int
    thick: int


def wall_thickness(walls: Image, gap: int, thick_share: float) -> WallThickness:
    """Measure straightened walls by the shorter of the two runs through each pixel; 1 where there is none.

    A closing of ``gap`` pixels first bridges missing cells; ``thick_share`` is the quantile of ``thick``.
    """
    mended = np.asarray(cv2.morphologyEx(walls, cv2.MORPH_CLOSE, np.ones((gap, gap), np.uint8)), np.uint8)
    across = np.minimum(run_lengths(mended), run_lengths(np.ascontiguousarray(mended.T)).T)
    thickness = np.sort(across[mended > 0])
    if not thickness.size:
        return WallThickness(1, 1)
    length = np.cumsum(1.0 / thickness)  # a wall of thickness t has t pixels for each of its length
    usual, thick = thickness[np.searchsorted(length, np.array([0.5, thick_share]) * length[-1])]
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


def closing_side(thickness: float) -> int:
    """Choose the side [pixels] of the closing square: odd, a little more than the wall, 3 for the thinnest.

    Chen uses 3 throughout.
    """
    return 2 * math.ceil(thickness / 2.0) + 1


def closed(walls: Image, side: int) -> Image:
    """Close the picture by a square of ``side`` pixels; its border closes nothing.

    Source: Chen 2021, section 5.3.
    """
    padded = np.pad(walls, side)
    mended = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, np.ones((side, side), np.uint8))
    return np.ascontiguousarray(mended[side:-side, side:-side]).astype(np.uint8)
