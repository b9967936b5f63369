"""Exhaustive search of a relative pose: correlation of points with a field of likelihoods.

Source: Olson, "Real-time correlative scan matching", ICRA 2009.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from mapping.grid.frame import require_area


class LikelihoodField(NamedTuple):
    """Likelihood exp(-d^2 / 2 spread^2) of a point at the distance d from the nearest wall, (rows, cols) cells of
    ``cell`` [m]; the corner of the first is at ``x``, ``y`` [m]. ``distance`` (rows, cols) is d [m]."""

    x: float
    y: float
    cell: float
    likelihood: NDArray[np.float32]
    distance: NDArray[np.float32]


def likelihood_field(points: NDArray[np.float64], cell: float, spread: float, margin: float) -> LikelihoodField:
    """Build the field of wall points (N, 2) [m], with ``margin`` [m] around them.

    Raises ``ValueError`` if they lie too far apart for a grid.
    """
    low = points.min(axis=0) - margin
    require_area("likelihood_field", low, points.max(axis=0) + margin, cell)
    shape = (np.ceil((points.max(axis=0) + margin - low) / cell).astype(np.int64) + 1)[::-1]
    walls = np.ones(shape, np.bool_)
    cols, rows = ((points - low) / cell).astype(np.int64).T
    walls[rows, cols] = False
    distance = (distance_transform_edt(walls) * cell).astype(np.float32)
    likelihood = np.exp(-0.5 * (distance / np.float32(spread)) ** 2)
    return LikelihoodField(float(low[0]), float(low[1]), cell, likelihood, distance)


@njit(cache=True)
def correlate(
    field: LikelihoodField,
    points: NDArray[np.float64],
    centre: NDArray[np.float64],
    reach: float,
    angles: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Return the mean likelihood of points (N, 2) at all shifts within ``reach`` [m] in steps of a cell, and all
    ``angles`` (A,) [rad], around the pose ``centre`` (3,): (A, S, S), shifts in y, then x."""
    half = math.ceil(reach / field.cell)
    side = 2 * half + 1
    rows, cols = field.likelihood.shape
    scores = np.zeros((angles.size, side, side), np.float32)
    for a in range(angles.size):
        yaw = centre[2] + angles[a]
        c, s = math.cos(yaw), math.sin(yaw)
        for k in range(points.shape[0]):
            x = centre[0] + c * points[k, 0] - s * points[k, 1] - field.x
            y = centre[1] + s * points[k, 0] + c * points[k, 1] - field.y
            col, row = math.floor(x / field.cell) - half, math.floor(y / field.cell) - half
            first, last = max(0, -col), min(side, cols - col)
            for r in range(max(0, -row), min(side, rows - row)):
                for q in range(first, last):
                    scores[a, r, q] += field.likelihood[row + r, col + q]
    return scores / np.float32(max(points.shape[0], 1))


def peaks(
    scores: NDArray[np.float32], cell: float, angles: NDArray[np.float64], apart: tuple[float, float], most: int
) -> list[tuple[float, NDArray[np.float64]]]:
    """Return the best scores with their shifts x, y [m] and angle [rad] (3,), best first; each lies farther than
    ``apart`` [m, rad] from all better ones in distance or angle."""
    half = scores.shape[1] // 2
    left = scores.copy()
    steps = (np.arange(scores.shape[1]) - half) * cell
    found: list[tuple[float, NDArray[np.float64]]] = []
    while len(found) < most:
        a, r, q = np.unravel_index(int(left.argmax()), left.shape)
        score = float(left[a, r, q])
        if score <= 0.0:
            break
        found.append((score, np.array([steps[q], steps[r], angles[a]])))
        near = (steps[:, None] - steps[r]) ** 2 + (steps[None, :] - steps[q]) ** 2 < apart[0] ** 2
        for turned in np.flatnonzero(np.abs(angles - angles[a]) < apart[1]):
            left[turned][near] = -1.0
    return found


def search_angles(window: float, step: float) -> NDArray[np.float64]:
    """Return the angles from -window to window [rad] in equal steps of at most ``step``, 0 among them."""
    count = max(1, math.ceil(window / step))
    return np.linspace(-window, window, 2 * count + 1)


def angle_step(points: NDArray[np.float64], cell: float) -> float:
    """Return the angle [rad] that moves most of the points (N, 2) by no more than a cell [m]."""
    return cell / max(float(np.percentile(np.hypot(*points.T), 75.0)), 1.0)


def thinned(points: NDArray[np.float64], cell: float, most: int) -> NDArray[np.float64]:
    """Keep one point of each cell [m], and of these at most ``most``, evenly spread over their order."""
    _, kept = np.unique(np.floor(points / cell).astype(np.int64), axis=0, return_index=True)
    kept = np.sort(kept)
    if len(kept) > most:
        kept = kept[np.linspace(0, len(kept) - 1, most).astype(np.int64)]
    return points[kept]
