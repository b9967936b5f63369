"""Step 5.3: close gaps in the walls."""

from __future__ import annotations

import math

import cv2
import numpy as np

from merge.literature.chen2021.binarisation import Image


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
