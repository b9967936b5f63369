"""Generate corridors that form loops."""

from __future__ import annotations

import numpy as np

from mapping.arrays import frozen_array
from worlds.building.drawing import WorldDrawing, require_size
from worlds.building.scatter import scattered
from worlds.polygon import Polygon, box, disc

PASSAGE = 1.0
"""Least gap between loose objects and anything else [m]."""

Side = list[tuple[float, float]]


def corridor_loop(rng: np.random.Generator, width: float = 40.0, height: float = 25.0) -> WorldDrawing:
    """Draw corridors along the border of ``width`` x ``height`` [m] and one across: two loops around solid blocks.

    Walls have closed doors and alcoves; benches and bins stand in the corridors. Raises ``ValueError`` below 16 x 12 m.
    """
    require_size("corridor_loop", width, height, (16.0, 12.0))
    rim = rng.uniform(0.9, 1.3, 4)
    ways = rng.uniform(2.1, 2.7, 5)
    cross = width * rng.uniform(0.35, 0.6)
    x0, y0, x1, y1 = rim[0] + ways[0], rim[1] + ways[1], width - rim[2] - ways[2], height - rim[3] - ways[3]
    blocks = [_block(rng, x0, y0, cross, y1), _block(rng, cross + ways[4], y0, x1, y1)]
    outer = _rim(rng, width, height, rim)
    standing = [*outer, *blocks]
    loose = scattered(_bins(rng, standing, width, height), [], PASSAGE)
    return WorldDrawing((*standing, *loose))


def _block(rng: np.random.Generator, x0: float, y0: float, x1: float, y1: float) -> Polygon:
    """Return a solid rectangle with niches in its four sides."""
    depth = min(1.4, (x1 - x0) / 4.0, (y1 - y0) / 4.0)
    low, right = _niches(rng, x1 - x0, depth), _niches(rng, y1 - y0, depth)
    high, left = _niches(rng, x1 - x0, depth), _niches(rng, y1 - y0, depth)
    corners = [(x0 + s, y0 + d) for s, d in low]
    corners += [(x1 - d, y0 + s) for s, d in right]
    corners += [(x1 - s, y1 - d) for s, d in high]
    corners += [(x0 + d, y1 - s) for s, d in left]
    return frozen_array(corners, np.float64)


def _rim(rng: np.random.Generator, width: float, height: float, rim: np.ndarray) -> list[Polygon]:
    """Return four walls along the border, with niches on the inside."""
    left, low, right, high = (float(each) for each in rim)
    depth = min(rim) - 0.3
    inner = [_niches(rng, length, depth, margin=max(rim) + 1.5) for length in (width, height, width, height)]
    slabs = [
        [(0.0, 0.0), (width, 0.0), *((width - s, low - d) for s, d in inner[0])],
        [(width, 0.0), (width, height), *((width - right + d, height - s) for s, d in inner[1])],
        [(width, height), (0.0, height), *((s, height - high + d) for s, d in inner[2])],
        [(0.0, height), (0.0, 0.0), *((left - d, s) for s, d in inner[3])],
    ]
    return [frozen_array(slab, np.float64) for slab in slabs]


def _niches(rng: np.random.Generator, length: float, depth: float, margin: float = 1.6) -> Side:
    """Draw the corners (along, inward) [m] of a side from 0 to ``length``, with closed doors and alcoves up to
    ``depth`` deep."""
    corners = [(0.0, 0.0)]
    along = margin + rng.uniform(0.0, 2.0)
    while True:
        is_door = rng.random() < 0.65
        wide = rng.uniform(0.9, 1.2) if is_door else rng.uniform(1.5, 3.0)
        deep = 0.15 if is_door else rng.uniform(0.5, 1.0) * depth
        if along + wide > length - margin:
            break
        corners += [(along, 0.0), (along, deep), (along + wide, deep), (along + wide, 0.0)]
        along += wide + rng.uniform(1.0, 5.0)
    return [*corners, (length, 0.0)] if margin > 1.6 else corners


def _bins(rng: np.random.Generator, standing: list[Polygon], width: float, height: float) -> list[Polygon]:
    """Draw benches, cabinets and bins against straight parts of the walls."""
    pieces: list[Polygon] = []
    for wall in standing:
        along = np.roll(wall, -1, axis=0) - wall
        length = np.hypot(*along.T)
        for start, way, long in zip(wall, along, length, strict=True):
            outside = (start[0] in (0.0, width) and way[0] == 0.0) or (start[1] in (0.0, height) and way[1] == 0.0)
            if outside or long < 2.4 or rng.random() < 0.5:
                continue
            unit = way / long
            out = np.array((unit[1], -unit[0]))
            size, deep = rng.uniform(0.4, 1.6), rng.uniform(0.3, 0.45)
            near = start + unit * rng.uniform(0.3, long - size - 0.3) - 0.01 * out
            if rng.random() < 0.25:
                middle = near + 0.2 * unit + 0.2 * out
                pieces.append(disc(float(middle[0]), float(middle[1]), 0.22, 14))
            else:
                far = near + size * unit + deep * out
                pieces.append(box(float(near[0]), float(near[1]), float(far[0]), float(far[1])))
    return pieces
