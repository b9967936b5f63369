"""A map as the grey image in which features are sought."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mapping.grid.occupancy_grid import OccupancyGrid

OCCUPIED_GREY, UNKNOWN_GREY, FREE_GREY = 0, 128, 255


def trinary_picture(grid: OccupancyGrid) -> NDArray[np.uint8]:
    """Draw the map in three greys, (rows, cols) uint8, highest row first: 0 occupied, 128 unknown, 255 free.

    Source: Chen 2021, section 4.1. Thresholds on grey are not needed, since log-odds have a sign.
    """
    picture = np.full(grid.frame.shape, UNKNOWN_GREY, dtype=np.uint8)
    picture[grid.occupied] = OCCUPIED_GREY
    picture[grid.free] = FREE_GREY
    return np.ascontiguousarray(picture[::-1])


def cells_from_pixels(pixels: NDArray[np.float64], rows: int) -> NDArray[np.float64]:
    """Points of the raster, (N, 2) rows of x, y in cells from its lower left corner, of pixels (N, 2) of its image.

    Pixel centres are at integers and v points down: pixel (0, rows - 1) is the point (0.5, 0.5).
    """
    return np.stack((pixels[:, 0] + 0.5, rows - 0.5 - pixels[:, 1]), axis=-1)


def pixels_from_cells(points: NDArray[np.float64], rows: int) -> NDArray[np.float64]:
    """Invert ``cells_from_pixels``."""
    return np.stack((points[:, 0] - 0.5, rows - 0.5 - points[:, 1]), axis=-1)
