"""How well two footprints agree where one is laid over the other: counted wall by wall, compiled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.ground_truth.footprint_layers import DEEP, NEAR


@njit(cache=True)
def agreement_of(hits: int, misses: int, total_walls: float) -> float:
    """``(hits / (hits + misses))^2 sqrt(hits / walls)``, with one miss more against division by zero."""
    return (hits / (hits + misses + 1.0)) ** 2 * math.sqrt(hits / total_walls)


@njit(cache=True)
def agreement_at(
    fixed_walls: NDArray[np.int64],
    fixed_says: NDArray[np.uint8],
    moving_walls: NDArray[np.int64],
    moving_says: NDArray[np.uint8],
    total_walls: float,
    row: int,
    col: int,
) -> float:
    """Agreement where the moving footprint's cell (0, 0) lies on the fixed one's cell ``row``, ``col``.

    Walls are (N, 2) row, col in the frame of their own footprint's cells, which are (rows, cols) uint8.
    """
    there, amiss = _hits_and_misses(moving_walls, fixed_says, row, col)
    back, astray = _hits_and_misses(fixed_walls, moving_says, -row, -col)
    return agreement_of(there + back, amiss + astray, total_walls)


@njit(cache=True)
def _hits_and_misses(walls: NDArray[np.int64], says: NDArray[np.uint8], row: int, col: int) -> tuple[int, int]:
    hits, misses = 0, 0
    for k in range(walls.shape[0]):
        i, j = walls[k, 0] + row, walls[k, 1] + col
        if 0 <= i < says.shape[0] and 0 <= j < says.shape[1]:
            hits += says[i, j] == NEAR
            misses += says[i, j] == DEEP
    return hits, misses
