"""Build the walled hall of Chen (2021) from its published dimensions."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.se2 import SE2
from worlds.building.drawing import WorldDrawing
from worlds.polygon import box, disc, turned_box

SIZE = (20.03, 20.01)
"""Width and height over the outer walls [m]."""
MIDDLE = (10.02, 10.01)
"""Position of the thesis' origin in the world [m]."""

LONG_BOXES = ((6.98, -0.52), (2.94, -0.54), (3.03, -4.98), (-0.99, -4.99))
"""Centres of boxes of 4 x 1 m."""
UPRIGHT_BOX = (-3.51, -6.98)
BLOCK = (-8.0, 0.0)
CUBES = ((4.93, -1.55), (4.92, 0.49), (1.54, -3.98), (8.52, 5.53), (8.52, 4.52), (2.50, -8.49), (-0.48, -8.48))
PILLARS = ((1.49, 5.48), (-1.50, 5.50), (-4.50, 5.51), (4.52, 5.51), (-6.53, -4.50))
STARTS = ((0.0, 0.0, 0.0), (-2.0, 3.0, 0.0), (-2.0, 3.0, math.pi / 2.0), (-2.0, 3.0, 2.0), (-2.0, -3.0, 3.0))
"""x, y, yaw; three of them share a position, for runs with one robot."""


def thesis_hall(_rng: np.random.Generator, width: float = SIZE[0], height: float = SIZE[1]) -> WorldDrawing:
    """Draw the hall, the same for every seed: 18 x 18 m free between walls of 1 m, boxes and pillars.

    Four equal pillars in a row allow wrong matches that are off by 3 m or 180 degrees. Raises ``ValueError`` for
    another size.
    """
    for name, value, own in zip(("width", "height"), (width, height), SIZE, strict=True):
        if value != own:
            raise ValueError(f"thesis_hall: {name} is {value:g} m, but the hall has one size only, {own:g} m")
    x, y = MIDDLE
    walls = (
        box(0.0, 0.0, 1.0, height),
        box(width - 1.0, 0.0, width, height),
        box(0.0, 0.0, width, 1.0),
        box(0.0, height - 1.0, width, height),
    )
    boxes = (
        *(turned_box(x + bx, y + by, 4.0, 1.0, 0.0) for bx, by in LONG_BOXES),
        turned_box(x + UPRIGHT_BOX[0], y + UPRIGHT_BOX[1], 1.0, 4.0, 0.0),
        turned_box(x + BLOCK[0], y + BLOCK[1], 2.0, 2.0, 0.0),
        *(turned_box(x + bx, y + by, 1.0, 1.0, 0.0) for bx, by in CUBES),
    )
    pillars = tuple(disc(x + px, y + py, 0.5, 48) for px, py in PILLARS)
    return WorldDrawing((*walls, *boxes, *pillars), tuple(SE2(x + sx, y + sy, yaw) for sx, sy, yaw in STARTS))
