"""Step 5.1: keep the walls alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from merge.preparation.map_image import UNKNOWN_GREY

Image = NDArray[np.uint8]
"""A picture (rows, cols) of two values, highest row first: ``WALL`` where there is wall, else 0."""

WALL = 255


def binarised(picture: Image) -> Image:
    """Make the walls of a grey picture (rows, cols) white and all else black; walls are dark.

    Source: Chen 2021, section 5.1. Pixels darker than unknown are walls. A picture of three greys needs no threshold.
    """
    return np.where(picture < UNKNOWN_GREY, WALL, 0).astype(np.uint8)
