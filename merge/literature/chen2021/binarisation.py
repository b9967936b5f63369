"""Step 5.1: the walls alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from merge.preparation.map_image import UNKNOWN_GREY

Image = NDArray[np.uint8]
"""A picture (rows, cols) of two values, highest row first: ``WALL`` where there is wall, else 0."""

WALL = 255


def binarised(picture: Image) -> Image:
    """Walls white, all else black, of a grey picture (rows, cols) whose walls are dark.

    Source: Chen 2021, section 5.1. What is darker than the unknown is wall: on three greys any threshold between says
    the same, so that none has to be set.
    """
    return np.where(picture < UNKNOWN_GREY, WALL, 0).astype(np.uint8)
