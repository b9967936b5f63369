"""Iterative closest points, compiled, from many starts at once."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.alignment.correspondences import add_equations, add_equations_back
from merge.alignment.settings import IcpSettings
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.surface import Surface, thinned

Thinned = tuple[NDArray[np.intp], float]
"""Indices of points, and the number of points that each represents."""

Constants = tuple[float, float, float]
"""The fields of ``IcpSettings``, in order."""


def icp_batch(
    target: PreparedMap,
    source: PreparedMap,
    starts: Sequence[Similarity2],
    gates: NDArray[np.float64],
    scale: ScaleRange,
    max_points: int,
    settings: IcpSettings = IcpSettings(),
) -> list[Similarity2]:
    """Move each start (target from source, cells) by one Gauss-Newton step for each of its gates.

    Source: iterative closest points (Besl and McKay 1992), point to line (Chen and Medioni 1992), from both maps to the
    other, on at most ``max_points`` wall points of either. ``gates`` (N, K) [target cells] has a row for each start:
    points further apart than the gate are not paired. A start that pairs too few points stays where it is.
    """
    if not starts or not len(source.points) or not len(target.points):
        return list(starts)
    matrices = np.array([start.matrix() for start in starts])
    there, here = thinned(len(target.points), max_points), thinned(len(source.points), max_points)
    bounds = np.array([scale.low, scale.high])
    constants = (settings.line_weight, settings.damping, settings.max_log_scale_step)
    _move_all(target.surface, source.surface, there, here, matrices, gates, bounds, source.middle, constants)
    return [Similarity2.from_matrix(matrix) for matrix in matrices]


@njit(cache=True)
def _move_all(
    target: Surface,
    source: Surface,
    there: Thinned,
    here: Thinned,
    matrices: NDArray[np.float64],
    gates: NDArray[np.float64],
    bounds: NDArray[np.float64],
    middle: NDArray[np.float64],
    constants: Constants,
) -> None:
    """Move the matrices (N, 2, 3) in place."""
    for k in range(len(matrices)):
        for gate in gates[k]:
            if not _step(target, source, there, here, matrices[k], gate, bounds, middle, constants):
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
    constants: Constants,
) -> bool:
    """Move one matrix (2, 3) in place by a step; return False if too few points are paired."""
    line_weight, damping_share, max_log_scale_step = constants
    scale = math.hypot(matrix[0, 0], matrix[1, 0])
    centre = matrix[:, 0] * middle[0] + matrix[:, 1] * middle[1] + matrix[:, 2]
    equations = np.zeros((4, 5))
    pairs = add_equations(target, source, here[0], here[1] * scale, matrix, gate, line_weight, centre, equations)
    pairs += add_equations_back(
        target, source, there[0], there[1], matrix, _inverse(matrix), gate / scale, line_weight, centre, equations
    )
    unknowns = 3 if bounds[0] == bounds[1] else 4
    if pairs < unknowns:
        return False
    hessian, gradient = equations[:unknowns, :unknowns].copy(), equations[:unknowns, 4].copy()
    damping = damping_share * np.trace(hessian)
    for k in range(unknowns):
        hessian[k, k] += damping
    step = np.linalg.solve(hessian, gradient).astype(np.float64)
    growth = math.exp(min(max(step[3], -max_log_scale_step), max_log_scale_step)) if unknowns == 4 else 1.0
    growth = min(max(scale * growth, bounds[0]), bounds[1]) / scale
    if not np.isfinite(step).all():
        return False
    _move(matrix, centre, step, growth)
    return True


@njit(cache=True)
def _move(matrix: NDArray[np.float64], centre: NDArray[np.float64], step: NDArray[np.float64], growth: float) -> None:
    """Shift by the first two of ``step``, rotate by the third and scale, about the centre, in place."""
    c, s = growth * math.cos(step[2]), growth * math.sin(step[2])
    matrix[:, 2] -= centre
    for column in range(3):
        x, y = matrix[0, column], matrix[1, column]
        matrix[0, column], matrix[1, column] = c * x - s * y, s * x + c * y
    matrix[:, 2] += centre + step[:2]


@njit(cache=True)
def _inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Invert a similarity (2, 3)."""
    inverse = np.empty((2, 3))
    square = matrix[0, 0] ** 2 + matrix[1, 0] ** 2
    inverse[0, 0], inverse[0, 1] = matrix[0, 0] / square, matrix[1, 0] / square
    inverse[1, 0], inverse[1, 1] = -matrix[1, 0] / square, matrix[0, 0] / square
    inverse[:, 2] = -(inverse[:, 0] * matrix[0, 2] + inverse[:, 1] * matrix[1, 2])
    return inverse
