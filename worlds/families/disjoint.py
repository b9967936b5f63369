"""Generate separate worlds side by side."""

from __future__ import annotations

import numpy as np

from mapping.arrays import frozen_array
from worlds.building.drawing import WorldDrawing, require_size
from worlds.families.house import house
from worlds.families.maze import maze
from worlds.families.office import office
from worlds.families.open_hall import open_hall
from worlds.polygon import Polygon, box

ROCK = 1.0
"""Thickness of the solid between the parts [m]."""
FAMILIES = (office, house, maze, open_hall)


def disjoint(rng: np.random.Generator, width: float = 40.0, height: float = 25.0) -> WorldDrawing:
    """Draw an office, a house, a maze and a hall in the quarters of ``width`` x ``height`` [m], in random order,
    separated by solid.

    Robots start in different parts as far as there are enough, so every merge of two such maps is wrong. Raises
    ``ValueError`` below 21 x 21 m.
    """
    require_size("disjoint", width, height, (21.0, 21.0))
    part = ((width - ROCK) / 2.0, (height - ROCK) / 2.0)
    pieces: list[Polygon] = [
        box(part[0], 0.0, part[0] + ROCK, height),
        box(0.0, part[1], width, part[1] + ROCK),
    ]
    corners = [(x, y) for x in (0.0, part[0] + ROCK) for y in (0.0, part[1] + ROCK)]
    for corner, index in zip(corners, rng.permutation(len(FAMILIES)), strict=True):
        drawing = FAMILIES[int(index)](rng, *part)
        pieces += [frozen_array(polygon + np.array(corner), np.float64) for polygon in drawing.obstacles]
    return WorldDrawing(tuple(pieces), parts=len(FAMILIES))
