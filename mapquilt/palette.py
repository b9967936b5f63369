"""The colours of every picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mapping.grid import OccupancyGrid

ROBOTS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C6BB1", "#6B4C2A")
"""Okabe and Ito's colours, which colour-blind readers tell apart, and two more; reused beyond eight."""

WALL, FREE, UNKNOWN = (31, 35, 40), (255, 255, 255), (214, 217, 221)
TRUE_WALL = "#b9bec6"
FENCE = "#b3007d"
INK = "#24292f"


def robot_colour(index: int) -> str:
    return ROBOTS[index % len(ROBOTS)]


def picture(grid: OccupancyGrid) -> NDArray[np.uint8]:
    """The grid as RGB (rows, cols, 3), row 0 lowest, as ``imshow(origin="lower")`` wants it."""
    image = np.empty((*grid.frame.shape, 3), np.uint8)
    image[:] = UNKNOWN
    image[grid.free] = FREE
    image[grid.occupied] = WALL
    return image
