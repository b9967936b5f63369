"""A maze."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from worlds.building.drawing import WorldDrawing, require_size
from worlds.building.floor_plan import WALL
from worlds.polygon import Polygon, box, disc

PITCH = 2.0
"""About how far one way of the maze is from the next [m]."""
LOOPS = 0.12
"""Share of the inner walls that are taken away, so that there is more than one way."""
BARRELS = 0.35
"""Share of the lower left corners with a barrel in them."""


def maze(rng: np.random.Generator, width: float = 20.0, height: float = 20.0) -> WorldDrawing:
    """Draw a maze of ``width`` x ``height`` [m]: ways about 1.85 m wide between walls of 0.15 m, some loops, barrels.

    Raises ``ValueError`` below 6 x 6 m.
    """
    require_size("maze", width, height, (6.0, 6.0))
    cols, rows = round((width - WALL) / PITCH), round((height - WALL) / PITCH)
    step = ((width - WALL) / cols, (height - WALL) / rows)
    below, left = _carved(rng, rows, cols)
    return WorldDrawing((*_walls(below, left, step), *_barrels(rng, below, left, step)))


def _carved(rng: np.random.Generator, rows: int, cols: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Walls below, (rows + 1, cols), and left, (rows, cols + 1), of each cell, by a random walk that backs up."""
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
    """Walls of one line that touch are one box."""
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
    """In the lower left corner of cells that have one, sunk a little into both walls."""
    pieces = []
    for row, col in np.argwhere(below[:-1] & left[:, :-1] & (rng.random((len(left), len(below[0]))) < BARRELS)):
        radius = rng.uniform(0.2, 0.32)
        pieces.append(disc(col * step[0] + WALL + radius - 0.02, row * step[1] + WALL + radius - 0.02, radius, 16))
    return pieces
