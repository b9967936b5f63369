"""Normal equations of corresponding surface points: the compiled loops under all refinement."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from merge.preparation.surface import Surface, nearest_point, normal_cosine

Equations = NDArray[np.float64]
"""Hessian (4, 4) and, as last column, gradient of x, y, yaw and log scale."""


@njit(cache=True)
def add_equations(
    target: Surface,
    source: Surface,
    kept: NDArray[np.intp],
    weight: float,
    answer: NDArray[np.float64],
    gate: float,
    line_weight: float,
    centre: NDArray[np.float64],
    equations: Equations,
) -> int:
    """Add the normal equations, about ``centre``, of the source's kept points and their nearest on the target.

    ``answer`` (2, 3) is target from source. Points further apart than ``gate`` [target cells] are not paired.
    ``line_weight`` is that of the distance along the normal. Return the number of pairs.
    """
    scale = math.hypot(answer[0, 0], answer[1, 0])
    c, s = answer[0, 0] / scale, answer[1, 0] / scale
    pairs = 0
    for k in kept:
        px, py, ax, ay = source[0][k, 0], source[0][k, 1], source[1][k, 0], source[1][k, 1]
        x = answer[0, 0] * px + answer[0, 1] * py + answer[0, 2]
        y = answer[1, 0] * px + answer[1, 1] * py + answer[1, 2]
        ax, ay = c * ax - s * ay, s * ax + c * ay
        index, distance = nearest_point(target, x, y, ax, ay)
        if not distance < gate:
            continue
        nx, ny = target[1][index, 0], target[1][index, 1]
        w = weight * pair_weight(distance / gate, normal_cosine(ax, ay, nx, ny))
        error_x, error_y = target[0][index, 0] - x, target[0][index, 1] - y
        pairs += _add(x - centre[0], y - centre[1], error_x, error_y, nx, ny, w, line_weight, equations)
    return pairs


@njit(cache=True)
def add_equations_back(
    target: Surface,
    source: Surface,
    kept: NDArray[np.intp],
    weight: float,
    answer: NDArray[np.float64],
    inverse: NDArray[np.float64],
    gate: float,
    line_weight: float,
    centre: NDArray[np.float64],
    equations: Equations,
) -> int:
    """Add those of the target's kept points and their nearest on the source; ``gate`` in source cells."""
    scale = math.hypot(answer[0, 0], answer[1, 0])
    c, s = answer[0, 0] / scale, answer[1, 0] / scale
    pairs = 0
    for k in kept:
        qx, qy, bx, by = target[0][k, 0], target[0][k, 1], target[1][k, 0], target[1][k, 1]
        there_x = inverse[0, 0] * qx + inverse[0, 1] * qy + inverse[0, 2]
        there_y = inverse[1, 0] * qx + inverse[1, 1] * qy + inverse[1, 2]
        index, distance = nearest_point(source, there_x, there_y, c * bx + s * by, -s * bx + c * by)
        if not distance < gate:
            continue
        ax, ay = source[1][index, 0], source[1][index, 1]
        nx, ny = c * ax - s * ay, s * ax + c * ay
        w = weight * pair_weight(distance / gate, normal_cosine(nx, ny, bx, by))
        px, py = source[0][index, 0], source[0][index, 1]
        x = answer[0, 0] * px + answer[0, 1] * py + answer[0, 2]
        y = answer[1, 0] * px + answer[1, 1] * py + answer[1, 2]
        pairs += _add(x - centre[0], y - centre[1], qx - x, qy - y, nx, ny, w, line_weight, equations)
    return pairs


@njit(cache=True)
def pair_weight(reach: float, cosine: float) -> float:
    """Weigh a pair of points ``reach`` gates apart: Tukey's biweight times the cosine of their normals, at least 0."""
    return float((1.0 - reach**2) ** 2 * max(cosine, 0.0))


@njit(cache=True)
def _add(
    arm_x: float,
    arm_y: float,
    error_x: float,
    error_y: float,
    nx: float,
    ny: float,
    weight: float,
    line_weight: float,
    equations: Equations,
) -> int:
    """Add one pair, unless its weight is 0; return the number of pairs added."""
    if weight <= 0.0:
        return 0
    # d moved / d (x, y, yaw, log scale): columns (1, 0), (0, 1), (-arm_y, arm_x), (arm_x, arm_y)
    dx, dy = (1.0, 0.0, -arm_y, arm_x), (0.0, 1.0, arm_x, arm_y)
    normal_error = nx * error_x + ny * error_y
    on_line, in_plane = weight * line_weight, weight * (1.0 - line_weight)
    for i in range(4):
        line_i = nx * dx[i] + ny * dy[i]
        for j in range(4):
            line_j = nx * dx[j] + ny * dy[j]
            equations[i, j] += on_line * line_i * line_j + in_plane * (dx[i] * dx[j] + dy[i] * dy[j])
        equations[i, 4] += on_line * line_i * normal_error + in_plane * (dx[i] * error_x + dy[i] * error_y)
    return 1
