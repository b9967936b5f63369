"""Colours of all pictures."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import coarsened

ROBOTS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C6BB1", "#6B4C2A")
"""The colours of Okabe and Ito, which are safe for colour-blind readers, and two more; reused beyond eight."""

WALL, FREE, UNKNOWN = (31, 35, 40), (255, 255, 255), (214, 217, 221)
TRUE_WALL = "#b9bec6"
FENCE = "#b3007d"
CONFLICT, CONFLICT_FREE = "#d01020", "#f5b0b4"
INK = "#24292f"
OUTCOME_COLOURS = {
    "true accept": "#007a5a",
    "false reject": "#B8860B",
    "false accept": "#c1121f",
    "true reject": "#8b949e",
}

MOST_CELLS = 1400
"""Cells a side of the largest grid that is drawn cell by cell; panels have 500 to 900 pixels a side."""

_OF_A_RUN = re.compile(r"robot_(\d+)(?:_part_\d+)?")
_DARKEST, _LIGHTEST = -0.3, 0.35


def robot_colour(index: int) -> str:
    return ROBOTS[index % len(ROBOTS)]


def map_colours(names: Sequence[str]) -> tuple[str, ...]:
    """Choose a colour for each map: a shade of its robot's colour for each part; in order for other names."""
    found = [_OF_A_RUN.fullmatch(name) for name in names]
    robots = [int(match[1]) for match in found if match]
    if len(robots) < len(names):
        return tuple(robot_colour(index) for index in range(len(names)))
    return tuple(
        shade(robot_colour(robot), robots[:index].count(robot), robots.count(robot))
        for index, robot in enumerate(robots)
    )


def shade(colour: str, index: int, count: int) -> str:
    """Return one of ``count`` shades of a colour, from dark to light; the colour itself if there is only one."""
    if count == 1:
        return colour
    lightness = _DARKEST + (_LIGHTEST - _DARKEST) * index / (count - 1)
    end = 255 if lightness > 0.0 else 0
    parts = bytes.fromhex(colour.removeprefix("#"))
    return "#" + bytes(round(part + abs(lightness) * (end - part)) for part in parts).hex()


def of_255(colour: tuple[int, int, int]) -> tuple[float, float, float]:
    """Convert a colour from 0..255 to 0..1 for matplotlib."""
    red, green, blue = colour
    return red / 255.0, green / 255.0, blue / 255.0


def at_screen_size(grid: OccupancyGrid) -> OccupancyGrid:
    """Coarsen a grid that has many more cells than a panel has pixels."""
    return (
        coarsened(grid, math.ceil(max(grid.frame.shape) / MOST_CELLS)) if max(grid.frame.shape) > MOST_CELLS else grid
    )


def picture(grid: OccupancyGrid, wall: tuple[int, int, int] = WALL) -> NDArray[np.uint8]:
    """Draw a grid as RGB (rows, cols, 3), row 0 lowest, for ``imshow(origin="lower")``."""
    image = np.empty((*grid.frame.shape, 3), np.uint8)
    image[:] = UNKNOWN
    image[grid.free] = FREE
    image[grid.occupied] = wall
    return image
