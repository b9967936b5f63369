"""Find the floor on which people can stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import ndimage

from mapping.arrays import frozen_array
from mapping.robot.trajectory import Trajectory
from worlds.raster import touched_cells, true_raster
from worlds.world import World

CELL = 0.1
"""Size of the raster's cells [m]."""


@dataclass(frozen=True, eq=False)
class FreeFloor:
    """Hold the cells (rows, cols) of ``CELL`` from the world's origin in which a disc can stand."""

    cells: NDArray[np.bool_]

    def __post_init__(self) -> None:
        object.__setattr__(self, "cells", frozen_array(self.cells, np.bool_))

    @cached_property
    def middles(self) -> NDArray[np.float64]:
        """Return the middle of each cell of the floor (N, 2) [m]."""
        return np.asarray((np.argwhere(self.cells)[:, ::-1] + 0.5) * CELL, dtype=np.float64)

    def count(self, per_100_m2: float) -> int:
        """Return the number of things at a density, rounded up."""
        return int(np.ceil(per_100_m2 * len(self.middles) * CELL**2 / 100.0))

    def random_place(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """Draw a place (2,) [m] from one number of ``rng``."""
        place: NDArray[np.float64] = self.middles[int(rng.random() * len(self.middles))]
        return place


def free_floor(world: World, paths: Sequence[Trajectory], radius: float) -> FreeFloor:
    """Find the floor where a disc of ``radius`` [m] fits, connected with the robots' paths and within the fence."""
    raster = true_raster(world, CELL)
    free = raster.free
    if world.fence is not None:
        free = free & touched_cells([world.fence], CELL, raster.frame.shape)
    gap = ndimage.distance_transform_edt(np.pad(free, 1))[1:-1, 1:-1] * CELL
    parts, _ = ndimage.label(gap > radius)
    places = np.floor(np.concatenate([path.poses[:, :2] for path in paths]) / CELL).astype(np.int64)
    rows, cols = np.clip(places[:, ::-1], 0, np.array(parts.shape) - 1).T
    visited = np.unique(parts[rows, cols])
    return FreeFloor(np.isin(parts, visited[visited > 0]))


@njit(cache=True)
def on_floor(cells: NDArray[np.bool_], x: float, y: float) -> bool:
    """Return True if the point [m] lies in a free one of the cells (rows, cols)."""
    row, col = int(np.floor(y / CELL)), int(np.floor(x / CELL))
    return 0 <= row < cells.shape[0] and 0 <= col < cells.shape[1] and bool(cells[row, col])


@njit(cache=True)
def clear_length(cells: NDArray[np.bool_], x: float, y: float, dx: float, dy: float, most: float) -> float:
    """Return how far one can walk from (x, y) along the unit vector (dx, dy), up to ``most`` [m], in whole cells."""
    length = 0.0
    while length + CELL <= most and on_floor(cells, x + (length + CELL) * dx, y + (length + CELL) * dy):
        length += CELL
    return length
