"""Preview of a sample: thumbnails of its maps."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.viz.palette import at_screen_size, picture

SIDE = 160
GAP = 4
MOST_COLUMNS = 6


def preview_png(maps: MapSet) -> bytes:
    """Draw the maps as thumbnails of equal size, row by row, as PNG."""
    tiles = [_tile(grid) for grid in maps.grids]
    columns = min(MOST_COLUMNS, len(tiles))
    blank = np.full_like(tiles[0], 255)
    tiles += [blank] * (-len(tiles) % columns)
    rows = [np.hstack(tiles[first : first + columns]) for first in range(0, len(tiles), columns)]
    done, data = cv2.imencode(".png", np.vstack(rows))
    if not done:
        raise RuntimeError("preview_png: OpenCV could not encode the picture")
    return data.tobytes()


def _tile(grid: OccupancyGrid) -> NDArray[np.uint8]:
    image = picture(at_screen_size(grid))[::-1]
    scale = SIDE / max(image.shape[:2])
    height, width = (max(1, round(size * scale)) for size in image.shape[:2])
    small = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    tile = np.full((SIDE + GAP, SIDE + GAP, 3), 255, np.uint8)
    top, left = (SIDE - height) // 2, (SIDE - width) // 2
    tile[top : top + height, left : left + width] = small
    return tile
