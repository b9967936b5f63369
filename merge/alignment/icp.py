"""Iterative closest points, compiled: many rough starts, or one with care."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.alignment.correspondences import add_equations, add_equations_back
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.surface import Surface
from merge.verification.wall_overlap import thinned

LINE_SHARE = 0.8
"""Weight of the distance along the normal; the rest is that of the plain distance, which holds ends and corners."""

DAMPING = 1e-12
"""Of the equations' trace, so that they can be solved whatever the walls."""

MOST_GROWTH = 0.1
"""Log scale of one step, at most."""

Thinned = tuple[NDArray[np.intp], float]
"""Indices of points, and how many each stands for."""


def icp_batch(
    target: PreparedMap,
    source: PreparedMap,
    starts: Sequence[Similarity2],
    gates: NDArray[np.float64],
    scale: ScaleRange,
    most_points: int,
) -> list[Similarity2]:
    """Each start (target from source, cells) moved by one Gauss-Newton step a gate.

    Source: iterative closest points (Besl and McKay 1992), point to line (Chen and Medioni 1992), both ways, on so many
    points of either surface. ``gates`` (N, K) [target cells], a row for each start, say how far apart two points may
    lie and still be paired. A start that pairs too little stays where it got to.
    """
    if not starts or not len(source.points) or not len(target.points):
        return list(starts)
    matrices = np.array([start.matrix() for start in starts])
    there, here = thinned(len(target.points), most_points), thinned(len(source.points), most_points)
    bounds = np.array([scale.low, scale.high])
    _descend_all(target.surface, source.surface, there, here, matrices, gates, bounds, source.middle)
    return [Similarity2.from_matrix(matrix) for matrix in matrices]


@njit(cache=True)
def _descend_all(
    target: Surface,
    source: Surface,
    there: Thinned,
    here: Thinned,
    matrices: NDArray[np.float64],
    gates: NDArray[np.float64],
    bounds: NDArray[np.float64],
    middle: NDArray[np.float64],
) -> None:
    """Move the matrices (N, 2, 3) in place."""
    for k in range(len(matrices)):
        for gate in gates[k]:
            if not _step(target, source, there, here, matrices[k], gate, bounds, middle):
                break


@njit(cache=True)
def _step(
    target: Surface,
    source: Surface,
    there: Thinned,
    here: Thinned,
    matrix: NDArray[np.float64],
    gate: float,
    bounds: NDArray[np.float64],
    middle: NDArray[np.float64],
) -> bool:
    """Move one matrix (2, 3) in place by a step; whether it could be."""
    scale = math.hypot(matrix[0, 0], matrix[1, 0])
    centre = matrix[:, 0] * middle[0] + matrix[:, 1] * middle[1] + matrix[:, 2]
    equations = np.zeros((4, 5))
    pairs = add_equations(target, source, here[0], here[1] * scale, matrix, gate, LINE_SHARE, centre, equations)
    pairs += add_equations_back(
        target, source, there[0], there[1], matrix, _inverse(matrix), gate / scale, LINE_SHARE, centre, equations
    )
    unknowns = 3 if bounds[0] == bounds[1] else 4
    if pairs < unknowns:
        return False
    hessian, gradient = equations[:unknowns, :unknowns].copy(), equations[:unknowns, 4].copy()
    damping = DAMPING * np.trace(hessian)
    for k in range(unknowns):
        hessian[k, k] += damping
    step = np.linalg.solve(hessian, gradient).astype(np.float64)
    growth = math.exp(min(max(step[3], -MOST_GROWTH), MOST_GROWTH)) if unknowns == 4 else 1.0
    growth = min(max(scale * growth, bounds[0]), bounds[1]) / scale
    if not np.isfinite(step).all():
        return False
    _move(matrix, centre, step, growth)
    return True


@njit(cache=True)
def _move(matrix: NDArray[np.float64], centre: NDArray[np.float64], step: NDArray[np.float64], growth: float) -> None:
    """Shift by the first two of ``step``, turn by the third and grow, about the centre, in place."""
    c, s = growth * math.cos(step[2]), growth * math.sin(step[2])
    matrix[:, 2] -= centre
    for column in range(3):
        x, y = matrix[0, column], matrix[1, column]
        matrix[0, column], matrix[1, column] = c * x - s * y, s * x + c * y
    matrix[:, 2] += centre + step[:2]


@njit(cache=True)
def _inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of a similarity (2, 3)."""
    inverse = np.empty((2, 3))
    square = matrix[0, 0] ** 2 + matrix[1, 0] ** 2
    inverse[0, 0], inverse[0, 1] = matrix[0, 0] / square, matrix[1, 0] / square
    inverse[1, 0], inverse[1, 1] = -matrix[1, 0] / square, matrix[0, 0] / square
    inverse[:, 2] = -(inverse[:, 0] * matrix[0, 2] + inverse[:, 1] * matrix[1, 2])
    return inverse
