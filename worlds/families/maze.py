"""Generate mazes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from worlds.building.drawing import WorldDrawing, require_size
from worlds.building.floor_plan import WALL
from worlds.polygon import Polygon, box, disc

PITCH = 2.0
"""Approximate distance between neighbouring passages [m]."""
LOOPS = 0.12
"""Fraction of the inner walls that are removed, to create loops."""
BARRELS = 0.35
"""Fraction of the lower left corners that hold a barrel."""


def maze(rng: np.random.Generator, width: float = 20.0, height: float = 20.0) -> WorldDrawing:
    """Draw a maze of ``width`` x ``height`` [m]: passages about 1.85 m wide, walls of 0.15 m, some loops, and barrels.

    Raises ``ValueError`` below 6 x 6 m.
    """
    require_size("maze", width, height, (6.0, 6.0))
    cols, rows = round((width - WALL) / PITCH), round((height - WALL) / PITCH)
    step = ((width - WALL) / cols, (height - WALL) / rows)
    below, left = _carved(rng, rows, cols)
    return WorldDrawing((*_walls(below, left, step), *_barrels(rng, below, left, step)))


def _carved(rng: np.random.Generator, rows: int, cols: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Carve the walls below (rows + 1, cols) and left (rows, cols + 1) of each cell, by a random walk with
    backtracking."""
    below, left = np.ones((rows + 1, cols), dtype=np.bool_), np.ones((rows, cols + 1), dtype=np.bool_)
    seen = np.zeros((rows, cols), dtype=np.bool_)
    way = [(int(rng.integers(rows)), int(rng.integers(cols)))]
    seen[way[0]] = True
    while way:
        row, col = way[-1]
        ahead = [
            (row + up, col + right)
            for up, right in ((0, 1), (1, 0), (0, -1), (-1, 0))
            if 0 <= row + up < rows and 0 <= col + right < cols and not seen[row + up, col + right]
        ]
        if not ahead:
            way.pop()
            continue
        step = ahead[int(rng.integers(len(ahead)))]
        if step[0] != row:
            below[max(row, step[0]), col] = False
        else:
            left[row, max(col, step[1])] = False
        seen[step] = True
        way.append(step)
    below[1:-1] &= rng.random((rows - 1, cols)) >= LOOPS
    left[:, 1:-1] &= rng.random((rows, cols - 1)) >= LOOPS
    return below, left


def _walls(below: NDArray[np.bool_], left: NDArray[np.bool_], step: tuple[float, float]) -> list[Polygon]:
    """Merge touching walls of one line into one box."""
    pieces = [
        box(a * step[0], row * step[1], b * step[0] + WALL, row * step[1] + WALL)
        for row, line in enumerate(below)
        for a, b in _runs(line)
    ]
    return pieces + [
        box(col * step[0], a * step[1], col * step[0] + WALL, b * step[1] + WALL)
        for col, line in enumerate(left.T)
        for a, b in _runs(line)
    ]


def _runs(line: NDArray[np.bool_]) -> list[tuple[int, int]]:
    changes = np.flatnonzero(np.diff(np.concatenate(([False], line, [False])).astype(np.int8)))
    return [(int(a), int(b)) for a, b in changes.reshape(-1, 2)]


def _barrels(
    rng: np.random.Generator, below: NDArray[np.bool_], left: NDArray[np.bool_], step: tuple[float, float]
) -> list[Polygon]:
    """Place barrels in lower left corners, slightly overlapping both walls."""
    pieces = []
    for row, col in np.argwhere(below[:-1] & left[:, :-1] & (rng.random((len(left), len(below[0]))) < BARRELS)):
        radius = rng.uniform(0.2, 0.32)
        pieces.append(disc(col * step[0] + WALL + radius - 0.02, row * step[1] + WALL + radius - 0.02, radius, 16))
    return pieces
