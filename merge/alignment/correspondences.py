"""One surface laid on another, point by point: the compiled loops under the measure and the refinement."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

FACING_COSINE = 0.5

Indices = NDArray[np.uint16] | NDArray[np.int32]

Surface = tuple[NDArray[np.float64], NDArray[np.float64], Indices, NDArray[np.float32], int]
"""Points (N, 2), normals (N, 2), nearest (4, rows, cols), depth and margin of a ``PreparedMap``."""

Equations = NDArray[np.float64]
"""Hessian and gradient of x, y, yaw and log scale, (4, 5)."""


@njit(cache=True)
def sector(nx: float, ny: float) -> int:
    """Which of the directions 0, 90, 180 and 270 degrees a normal is nearest to: 0 to 3."""
    if abs(nx) >= abs(ny):
        return 0 if nx >= 0.0 else 2
    return 1 if ny >= 0.0 else 3


@njit(cache=True)
def nearest_point(below: Surface, x: float, y: float, nx: float, ny: float) -> tuple[int, float]:
    """Index of the point nearest to (x, y) among the surface that faces about the same way as (nx, ny), and its
    distance; -1 and inf if there is none. A zero normal faces every way.
    """
    points, _, nearest, _, margin = below
    col, row = math.floor(x) + margin, math.floor(y) + margin
    best, best_distance = -1, math.inf
    if col < 0 or row < 0 or row >= nearest.shape[1] or col >= nearest.shape[2]:
        return best, best_distance
    everywhere = nx == 0.0 and ny == 0.0
    first = 0 if everywhere else sector(nx, ny)
    for k in range(first, 4 if everywhere else first + 1):
        index = int(nearest[k, row, col])
        if index < len(points):
            distance = math.hypot(x - points[index, 0], y - points[index, 1])
            if distance < best_distance:
                best, best_distance = index, distance
    return best, best_distance


@njit(cache=True)
def nearest_points(
    below: Surface, points: NDArray[np.float64], normals: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """``nearest_point`` of many points (N, 2) with their normals (N, 2): indices (N,) and distances (N,)."""
    indices, distances = np.empty(len(points), np.intp), np.empty(len(points))
    for k in range(len(points)):
        indices[k], distances[k] = nearest_point(below, points[k, 0], points[k, 1], normals[k, 0], normals[k, 1])
    return indices, distances


@njit(cache=True)
def depth_at(below: Surface, x: float, y: float) -> float:
    """How deep in free space (x, y) lies [cells]; 0 where it is not free."""
    depth, margin = below[3], below[4]
    col, row = math.floor(x) + margin, math.floor(y) + margin
    if col < 0 or row < 0 or row >= depth.shape[0] or col >= depth.shape[1]:
        return 0.0
    return float(depth[row, col])


@njit(cache=True)
def facing(ax: float, ay: float, bx: float, by: float) -> float:
    """Cosine between unit normals; 1 where either is zero, since such a wall faces every way."""
    if (ax == 0.0 and ay == 0.0) or (bx == 0.0 and by == 0.0):
        return 1.0
    return ax * bx + ay * by


@njit(cache=True)
def count_wall_overlap(
    below: Surface,
    above: Surface,
    kept: NDArray[np.intp],
    matrix: NDArray[np.float64],
    tolerances: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How the kept points of ``above``, moved by ``matrix`` (2, 3), lie on ``below``, by tolerance, loosest first.

    Numbers (K, 3) of those on walls that face the same way, just in front of walls that face the other way, and deep
    in free space; and xx, xy and yy (3,) of the sum of n n^T over those on walls by the first tolerance.
    """
    scale = math.hypot(matrix[0, 0], matrix[1, 0])
    c, s = matrix[0, 0] / scale, matrix[1, 0] / scale
    counts, scatter = np.zeros((len(tolerances), 3)), np.zeros(3)
    for k in kept:
        px, py, ax, ay = above[0][k, 0], above[0][k, 1], above[1][k, 0], above[1][k, 1]
        x = matrix[0, 0] * px + matrix[0, 1] * py + matrix[0, 2]
        y = matrix[1, 0] * px + matrix[1, 1] * py + matrix[1, 2]
        nx, ny = c * ax - s * ay, s * ax + c * ay
        index, away = nearest_point(below, x, y, nx, ny)
        if index >= 0 and facing(nx, ny, below[1][index, 0], below[1][index, 1]) <= FACING_COSINE:
            away = math.inf
        if away <= tolerances[0]:
            scatter[0] += nx * nx
            scatter[1] += nx * ny
            scatter[2] += ny * ny
        if away <= tolerances[-1]:
            counts[:, 0] += 1.0
            continue
        across, opposed = _behind_or_in_front(below, x, y, nx, ny)
        deep = depth_at(below, x, y)
        for level, tolerance in enumerate(tolerances):
            if away <= tolerance:
                counts[level, 0] += 1.0
            elif across <= tolerance:
                counts[level, 1] += opposed
            elif deep > tolerance:
                counts[level, 2] += 1.0
    return counts, scatter


@njit(cache=True)
def _behind_or_in_front(below: Surface, x: float, y: float, nx: float, ny: float) -> tuple[float, bool]:
    """Distance to the nearest surface that faces about the other way, and whether (x, y) lies in front of it."""
    index, distance = nearest_point(below, x, y, -nx, -ny)
    if index < 0:
        return distance, False
    qx, qy = below[1][index, 0], below[1][index, 1]
    in_front = (x - below[0][index, 0]) * qx + (y - below[0][index, 1]) * qy > 0.0
    return distance, in_front and facing(nx, ny, qx, qy) < -FACING_COSINE


@njit(cache=True)
def add_equations(
    target: Surface,
    source: Surface,
    kept: NDArray[np.intp],
    weight: float,
    answer: NDArray[np.float64],
    gate: float,
    line_share: float,
    centre: NDArray[np.float64],
    equations: Equations,
) -> int:
    """Add the normal equations, about ``centre``, of the source's kept points and their nearest on the target.

    ``answer`` (2, 3) is target from source; points further apart than ``gate`` (target cells) are not paired. Returns
    the number of pairs.
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
        w = weight * _pair_weight(distance / gate, facing(ax, ay, nx, ny))
        error_x, error_y = target[0][index, 0] - x, target[0][index, 1] - y
        pairs += _add(x - centre[0], y - centre[1], error_x, error_y, nx, ny, w, line_share, equations)
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
    line_share: float,
    centre: NDArray[np.float64],
    equations: Equations,
) -> int:
    """The same for the target's kept points and their nearest on the source; ``gate`` in source cells."""
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
        w = weight * _pair_weight(distance / gate, facing(nx, ny, bx, by))
        px, py = source[0][index, 0], source[0][index, 1]
        x = answer[0, 0] * px + answer[0, 1] * py + answer[0, 2]
        y = answer[1, 0] * px + answer[1, 1] * py + answer[1, 2]
        pairs += _add(x - centre[0], y - centre[1], qx - x, qy - y, nx, ny, w, line_share, equations)
    return pairs


@njit(cache=True)
def _pair_weight(reach: float, cosine: float) -> float:
    """Of two points ``reach`` gates apart: Tukey's biweight, by how alike they face; 0 where they face apart."""
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
    line_share: float,
    equations: Equations,
) -> int:
    """Add one pair; how many were added: none where the weight is 0."""
    if weight <= 0.0:
        return 0
    # d moved / d (x, y, yaw, log scale): columns (1, 0), (0, 1), (-arm_y, arm_x), (arm_x, arm_y)
    dx, dy = (1.0, 0.0, -arm_y, arm_x), (0.0, 1.0, arm_x, arm_y)
    normal_error = nx * error_x + ny * error_y
    on_line, in_plane = weight * line_share, weight * (1.0 - line_share)
    for i in range(4):
        line_i = nx * dx[i] + ny * dy[i]
        for j in range(4):
            line_j = nx * dx[j] + ny * dy[j]
            equations[i, j] += on_line * line_i * line_j + in_plane * (dx[i] * dx[j] + dy[i] * dy[j])
        equations[i, 4] += on_line * line_i * normal_error + in_plane * (dx[i] * error_x + dy[i] * error_y)
    return 1
