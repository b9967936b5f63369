"""Generate open halls."""

from __future__ import annotations

import numpy as np

from worlds.building.drawing import WorldDrawing, require_size
from worlds.building.floor_plan import WALL, outer_walls
from worlds.building.scatter import scattered
from worlds.polygon import Polygon, box, disc, turned_box

PASSAGE = 1.2
"""Least gap between objects in the hall [m]."""


def open_hall(rng: np.random.Generator, width: float = 30.0, height: float = 30.0) -> WorldDrawing:
    """Draw a hall of ``width`` x ``height`` [m] with two rows of pillars, a stage, booths at the walls and tables.

    Raises ``ValueError`` below 10 x 10 m.
    """
    require_size("open_hall", width, height, (10.0, 10.0))
    standing = outer_walls(width, height) + _pillars(rng, width, height)
    standing.append(_stage(rng, width, height))
    standing += scattered(_booths(rng, width, height), standing[4:], PASSAGE)
    return WorldDrawing((*standing, *scattered(_tables(rng, width, height), standing, PASSAGE)))


def _pillars(rng: np.random.Generator, width: float, height: float) -> list[Polygon]:
    """Draw two rows of equal pillars along y, round or square."""
    side, span, round_ones = rng.uniform(0.5, 0.8), rng.uniform(5.0, 7.0), rng.random() < 0.5
    count = max(1, int(height / span) - 1)
    inset = width * rng.uniform(0.2, 0.3)
    pieces = []
    for x in (inset, width - inset):
        for y in height * (np.arange(count) + 1.0) / (count + 1.0):
            if round_ones:
                pieces.append(disc(x, float(y), side / 2.0, 20))
            else:
                pieces.append(turned_box(x, float(y), side, side, 0.0))
    return pieces


def _stage(rng: np.random.Generator, width: float, height: float) -> Polygon:
    long, deep = width * rng.uniform(0.25, 0.35), min(3.5, height * 0.12)
    x = (width - long) * rng.uniform(0.25, 0.75)
    return box(x, height - WALL - deep, x + long, height - WALL / 2.0)


def _booths(rng: np.random.Generator, width: float, height: float) -> list[Polygon]:
    """Draw a few boxes against the left, right and lower wall."""
    pieces = []
    for _ in range(int((width + 2.0 * height) / 7.0)):
        long, deep = rng.uniform(1.5, 3.0), rng.uniform(0.6, 1.8)
        side, share = int(rng.integers(3)), rng.random()
        if side == 0:
            x = WALL + 1.2 + share * (width - 2.0 * WALL - 2.4 - long)
            pieces.append(box(x, WALL / 2.0, x + long, WALL + deep))
            continue
        y = WALL + 1.2 + share * (height - 2.0 * WALL - 2.4 - long)
        x0, x1 = (WALL / 2.0, WALL + deep) if side == 1 else (width - WALL - deep, width - WALL / 2.0)
        pieces.append(box(x0, y, x1, y + long))
    return pieces


def _tables(rng: np.random.Generator, width: float, height: float) -> list[Polygon]:
    """Draw tables, displays and a counter on the floor, about one per 45 square metres."""
    pieces = [turned_box(width / 2.0, height * rng.uniform(0.3, 0.6), 3.2, 1.1, rng.uniform(0.0, np.pi))]
    for _ in range(int(width * height / 45.0)):
        x, y = (float(each) for each in rng.uniform((1.0, 1.0), (width - 1.0, height - 1.0)))
        kind = rng.random()
        if kind < 0.4:
            pieces.append(disc(x, y, rng.uniform(0.4, 0.8), 16))
        elif kind < 0.8:
            pieces.append(turned_box(x, y, rng.uniform(1.2, 2.0), 0.8, rng.uniform(0.0, np.pi)))
        else:
            pieces.append(turned_box(x, y, rng.uniform(1.8, 2.6), 0.15, rng.uniform(0.0, np.pi)))
    return pieces
