"""Step 5.2, second half: rotate the map so that its walls run along rows and columns."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from merge.literature.chen2021.binarisation import WALL, Image

HALF_GREY = 127

MARGIN = 16
"""Pixels left around the walls."""


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


def straightened(walls: Image, angle: float) -> Straightened:
    """Rotate the picture by ``-angle`` [rad, from u to v], so that walls along ``angle`` run along rows.

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
    return _cut(np.where(turned > HALF_GREY, WALL, 0).astype(np.uint8), matrix)


def _cut(walls: Image, matrix: NDArray[np.float64]) -> Straightened:
    rows, cols = np.flatnonzero(walls.any(axis=1)), np.flatnonzero(walls.any(axis=0))
    if not rows.size:
        return Straightened(walls, matrix)
    padded = np.pad(walls[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1], MARGIN)
    corner = np.array([cols[0] - MARGIN, rows[0] - MARGIN], np.float64)
    return Straightened(padded, np.column_stack((matrix[:, :2], matrix[:, 2] - corner)))
