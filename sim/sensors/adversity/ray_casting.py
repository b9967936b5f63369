"""Cast beams against segments and discs."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


def cast_on_discs(
    origin: NDArray[np.float64], directions: NDArray[np.float64], centres: NDArray[np.float64], radius: float
) -> NDArray[np.float64]:
    """Return the distance (B,) [m] along unit directions (B, 2) from ``origin`` (2,) to the nearest disc.

    It is +inf if the beam hits none. ``centres`` (P, 2) [m]. A disc around the origin itself is ignored.
    """
    offsets = centres - origin
    squared = (offsets**2).sum(axis=1)
    offsets, squared = offsets[squared > radius**2], squared[squared > radius**2]
    along = directions @ offsets.T
    inside = radius**2 - (squared - along**2)
    hit = (inside >= 0.0) & (along > 0.0)
    distance = np.where(hit, along - np.sqrt(np.where(hit, inside, 0.0)), np.inf)
    nearest: NDArray[np.float64] = distance.min(axis=1, initial=np.inf)
    return nearest


@njit(cache=True)
def cast_on_segments(
    origin: NDArray[np.float64], directions: NDArray[np.float64], segments: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the distance (B,) [m] along unit directions (B, 2) from ``origin`` (2,) to the nearest of the segments
    (M, 2, 2), +inf for none."""
    nearest = np.full(len(directions), np.inf)
    for beam in range(len(directions)):
        for each in range(len(segments)):
            distance = crossing(origin[0], origin[1], directions[beam, 0], directions[beam, 1], segments[each])
            nearest[beam] = min(nearest[beam], distance)
    return nearest


@njit(cache=True)
def crossing(x: float, y: float, dx: float, dy: float, segment: NDArray[np.float64]) -> float:
    """Return the distance from (x, y) along the unit vector (dx, dy) to a segment (2, 2), +inf if it misses."""
    ex, ey = segment[1, 0] - segment[0, 0], segment[1, 1] - segment[0, 1]
    ox, oy = segment[0, 0] - x, segment[0, 1] - y
    turn = dx * ey - dy * ex
    if turn == 0.0:
        return math.inf
    distance, share = (ox * ey - oy * ex) / turn, (ox * dy - oy * dx) / turn
    return distance if distance >= 0.0 and 0.0 <= share <= 1.0 else math.inf
