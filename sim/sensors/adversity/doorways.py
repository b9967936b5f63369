"""Find the doorways of a world: narrow gaps in straight walls."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from worlds.raster import true_raster
from worlds.world import World

CELL = 0.05
"""Size of the raster's cells [m]."""
NARROWEST, WIDEST = 0.7, 1.4
"""Widths of doorways [m]; a wheelchair needs 0.8 m, double doors are wider than 1.4 m."""
POST = 0.2
"""Length of straight wall required at both ends [m]; shorter pieces are furniture or the ends of walls."""
STRAIGHT = math.cos(math.radians(5.0))
"""Cosine of the greatest angle between a doorway and the wall beside it."""
ROOM = 0.6
"""Free way required on both sides of the middle [m]."""


def find_doorways(world: World) -> NDArray[np.float64]:
    """Find the doorways (D, 2, 2): both ends [m] of each, in a fixed order.

    A doorway is the line between two corners of obstacles, if walls continue it at both ends, it is free, and one can
    pass it across. Of doorways whose middles are less than a doorway apart, only the shortest counts.
    """
    if not world.obstacles:
        return np.empty((0, 2, 2))
    corners = np.concatenate(world.obstacles)
    walls = np.stack(
        [np.concatenate([np.roll(each, shift, axis=0) for each in world.obstacles]) for shift in (1, -1)], 1
    )
    walls -= corners[:, None]
    pairs = cKDTree(corners).query_pairs(WIDEST, output_type="ndarray")
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    widths = np.hypot(*(corners[pairs[:, 1]] - corners[pairs[:, 0]]).T)
    pairs, widths = pairs[widths >= NARROWEST], widths[widths >= NARROWEST]
    pairs = pairs[np.argsort(widths, kind="stable")]
    a, b = pairs.T
    along = corners[b] - corners[a]
    pairs = pairs[_continued(walls[a], -along) & _continued(walls[b], along)]
    gaps = corners[pairs]
    return _apart(gaps[_is_open(true_raster(world, CELL).free, gaps)])


def _continued(walls: NDArray[np.float64], direction: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return where one of the two edges (N, 2, 2) from a corner leads straight on along ``direction`` (N, 2)."""
    length = np.hypot(walls[..., 0], walls[..., 1])
    along = np.einsum("nij,nj->ni", walls, direction) / np.hypot(*direction.T)[:, None]
    continued: NDArray[np.bool_] = ((length >= POST) & (along >= STRAIGHT * length)).any(axis=1)
    return continued


def _is_open(free: NDArray[np.bool_], gaps: NDArray[np.float64]) -> NDArray[np.bool_]:
    start, along = gaps[:, 0], gaps[:, 1] - gaps[:, 0]
    normal = np.stack((-along[:, 1], along[:, 0]), axis=-1) / np.hypot(*along.T)[:, None]
    between = start[:, None] + np.linspace(0.1, 0.9, 17)[:, None] * along[:, None]
    across = (start + along / 2.0)[:, None] + np.linspace(-ROOM, ROOM, 25)[:, None] * normal[:, None]
    return np.asarray(np.concatenate((_free_at(free, between), _free_at(free, across)), axis=1).all(axis=1))


def _free_at(free: NDArray[np.bool_], points: NDArray[np.float64]) -> NDArray[np.bool_]:
    col, row = np.moveaxis(np.floor(points / CELL).astype(np.int64), -1, 0)
    within = (row >= 0) & (row < free.shape[0]) & (col >= 0) & (col < free.shape[1])
    return np.asarray(within & free[np.clip(row, 0, free.shape[0] - 1), np.clip(col, 0, free.shape[1] - 1)])


def _apart(gaps: NDArray[np.float64]) -> NDArray[np.float64]:
    kept: list[int] = []
    middles = gaps.mean(axis=1)
    for k, middle in enumerate(middles):
        if not kept or np.hypot(*(middles[kept] - middle).T).min() > NARROWEST:
            kept.append(k)
    return gaps[kept]
