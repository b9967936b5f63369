"""Step 5.3: gaps in the walls closed."""

from __future__ import annotations

import math

import cv2
import numpy as np

from merge.literature.chen2021.binarisation import Image


def closing_side(thickness: float) -> int:
    """Side [pixels] of the square that walls of this thickness are closed with: odd, a little more than the wall, 3
    for the thinnest. Chen's is 3 throughout."""
    return 2 * math.ceil(thickness / 2.0) + 1


def closed(walls: Image, side: int) -> Image:
    """Morphological closing with a square of ``side`` pixels; the picture's border closes nothing.

    Source: Chen 2021, section 5.3.
    """
    padded = np.pad(walls, side)
    mended = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, np.ones((side, side), np.uint8))
    return np.ascontiguousarray(mended[side:-side, side:-side]).astype(np.uint8)
