"""Keypoints of the corrected picture: corners and ends of its lines."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from merge.literature.chen2021.binarisation import Image

MOST_CORNERS = 400
QUALITY = 0.1
"""Least corner response as a share of the strongest."""

STOP = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 20, 0.05)


def corners(structure: Image, half: int) -> NDArray[np.float64]:
    """Detect pixels (N, 2) u, v, strongest first, at which lines of the main structure meet, bend or end.

    Chen 2021 uses SIFT and drops keypoints off the walls. On lines of one pixel SIFT also marks blobs between them; the
    corner detector of Shi and Tomasi 1994 marks corners alone. Its window and the least distance of two corners follow
    the size of a tile, 2 ``half`` + 1.
    """
    tile = 2 * half + 1
    margin = 2 * tile + 5  # what the refinement needs around its window
    lines = cv2.dilate(np.pad(structure, margin), np.ones((3, 3), np.uint8))
    found = cv2.goodFeaturesToTrack(lines, MOST_CORNERS, QUALITY, 2 * tile, blockSize=2 * tile + 1)
    if found is None:
        return np.empty((0, 2))
    sharp = cv2.cornerSubPix(lines, found.copy(), (tile, tile), (-1, -1), STOP)
    near = np.abs(sharp - found).max(axis=-1, keepdims=True) <= 2 * tile
    return np.where(near, sharp, found)[:, 0].astype(np.float64) - margin
