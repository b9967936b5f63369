"""Generate warehouses."""

from __future__ import annotations

import numpy as np

from worlds.building.drawing import WorldDrawing, require_size
from worlds.building.floor_plan import WALL, outer_walls
from worlds.building.scatter import scattered
from worlds.polygon import Polygon, box, turned_box

BAY = 2.7
"""Length of one bay of a rack [m]: three pallets and an upright."""
DEEP = 1.1
"""Depth of a rack [m]."""
UPRIGHT = 0.12
FLUE = 0.1
"""Overlap of two racks that stand back to back [m], so that no ray passes between them."""
PASSAGE = 1.0
"""Least gap between objects on the floor [m]."""


def warehouse(rng: np.random.Generator, width: float = 40.0, height: float = 25.0) -> WorldDrawing:
    """Draw a warehouse of ``width`` x ``height`` [m]: rows of racks along x with aisles and a cross aisle, a dock at
    the left with pallets and an office, and loose objects.

    A bay is full, half full, or empty except for the uprights. Raises ``ValueError`` below 20 x 12 m.
    """
    require_size("warehouse", width, height, (20.0, 12.0))
    dock = rng.uniform(6.0, 8.0)
    office = _office(rng, height)
    racks = _racks(rng, dock, width, height)
    standing = outer_walls(width, height) + office + racks
    return WorldDrawing((*standing, *scattered(_loose(rng, dock, width, height), standing, PASSAGE)))


def _office(rng: np.random.Generator, height: float) -> list[Polygon]:
    """Return two walls with a door around the upper left corner, and a desk."""
    wide, deep, door = rng.uniform(3.6, 4.4), rng.uniform(3.0, 4.0), rng.uniform(0.95, 1.1)
    low, at = height - WALL - deep, rng.uniform(0.4, 3.6 - 1.6)
    return [
        box(wide, low, wide + WALL, height - WALL / 2.0),
        box(WALL / 2.0, low, at + WALL, low + WALL),
        box(at + WALL + door, low, wide + WALL, low + WALL),
        box(WALL / 2.0, height - WALL - 1.5, WALL + 0.8, height - WALL / 2.0),
    ]


def _racks(rng: np.random.Generator, dock: float, width: float, height: float) -> list[Polygon]:
    """Draw rows along x: the outer ones against the walls, pairs back to back inside, with aligned bays."""
    aisle = rng.uniform(2.6, 3.2)
    pairs = max(1, int((height - 2.0 * DEEP - 2.0 * WALL - aisle) / (2.0 * DEEP - FLUE + aisle)))
    free = height - 2.0 * WALL - 2.0 * DEEP - pairs * (2.0 * DEEP - FLUE)
    step = free / (pairs + 1) + 2.0 * DEEP - FLUE
    first = WALL + DEEP + free / (pairs + 1)
    rows = [WALL - 0.01, height - WALL - DEEP + 0.01]
    for pair in range(pairs):
        rows += [first + pair * step, first + pair * step + DEEP - FLUE]
    cross = rng.uniform(2.8, 3.4)
    bays = int((width - dock - 2.0 * 2.8 - cross) / BAY)
    split = int(np.clip(round(bays * rng.uniform(0.35, 0.65)), 1, max(1, bays - 1)))
    starts = [dock + index * BAY + (cross if index >= split else 0.0) for index in range(bays)]
    pieces = []
    for y in rows:
        for x in starts:
            pieces += _bay(rng, x, y)
        pieces += [box(x + BAY - UPRIGHT, y, x + BAY + UPRIGHT, y + DEEP) for x in (starts[split - 1], starts[-1])]
        pieces += [box(x - UPRIGHT, y, x + UPRIGHT, y + DEEP) for x in (starts[0], starts[split % bays])]
    return pieces


def _bay(rng: np.random.Generator, x: float, y: float) -> list[Polygon]:
    """Draw four uprights and the pallets between them: three, two or none."""
    corners = [(x, y), (x + BAY, y), (x, y + DEEP - UPRIGHT), (x + BAY, y + DEEP - UPRIGHT)]
    posts = [box(cx - UPRIGHT / 2.0, cy, cx + UPRIGHT / 2.0, cy + UPRIGHT) for cx, cy in corners]
    state = rng.random()
    if state < 0.62:
        return [*posts, box(x + 0.05, y, x + BAY - 0.05, y + DEEP)]
    if state < 0.85:
        slots = rng.permutation(3)[:2]
        third = (BAY - 0.1) / 3.0
        return posts + [box(x + 0.05 + k * third, y, x + 0.05 + (k + 1) * third, y + DEEP) for k in sorted(slots)]
    return posts


def _loose(rng: np.random.Generator, dock: float, width: float, height: float) -> list[Polygon]:
    """Draw pallets at the dock, a fork lift, and boxes in the aisles."""
    pieces = [turned_box(dock * 0.5, rng.uniform(0.3, 0.6) * height, 2.4, 1.1, rng.uniform(0.0, np.pi))]
    for _ in range(24):
        x, y = rng.uniform((1.2, 1.2), (dock - 1.6, height - 1.2))
        pieces.append(turned_box(float(x), float(y), 1.2, 0.8, rng.normal(0.0, 0.08) + rng.integers(2) * np.pi / 2.0))
    for _ in range(30):
        x, y = rng.uniform((dock, 1.0), (width - 1.0, height - 1.0))
        size = rng.uniform(0.4, 0.9, 2)
        pieces.append(turned_box(float(x), float(y), float(size[0]), float(size[1]), rng.uniform(0.0, np.pi)))
    return pieces
