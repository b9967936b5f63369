"""Elastic alignment: the source bends smoothly until its walls lie on those of the target."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from merge.alignment.correspondences import pair_weight
from merge.alignment.settings import ElasticSettings
from merge.preparation.prepared_map import PreparedMap, smaller_diagonal
from merge.preparation.surface import Surface, nearest_point, nearest_points, normal_cosine, thinned
from merge.records.bend import Bend, Nodes, displacement, element, place_before

Band = NDArray[np.float64]
"""Lower band (N, W) of a symmetric matrix: element (i, i - k) is in row i and column k."""

Vector = NDArray[np.float64]

Control = tuple[Vector, float]
"""Corner (2,) and spacing of the control grid, as in ``Bend``."""

Weights = tuple[float, float, float]
"""Weights of the mean squared strain and curvature [squared cells], and of the distance along the normal."""


def bend_onto(
    target: PreparedMap,
    source: PreparedMap,
    target_from_source: Similarity2,
    settings: ElasticSettings = ElasticSettings(),
) -> Bend:
    """Bend the source so that its walls, moved by ``target_from_source`` (cells), lie on those of the target.

    The unknowns are the displacements of a control grid; steps of Gauss-Newton with a gate that narrows minimise the
    mean squared distance of paired walls, as ``icp_batch`` pairs them, plus an elastic energy: the mean squared strain,
    which no rigid motion changes, and a little of the curvature, which spreads the bend over parts without common
    walls. Source: non-rigid registration by free-form deformation (Rueckert et al. 1999), with linear elasticity.
    """
    scale = target_from_source.scale
    diagonal = smaller_diagonal(target, source, scale) / scale
    rest = Bend.at_rest(source.points, settings.node_share * diagonal)
    nodes = rest.nodes.copy()
    gates = np.array(settings.gate_shares) * diagonal
    weights = (settings.stiffness * diagonal**2, settings.curvature * diagonal**2, settings.line_weight)
    there, here = thinned(len(target.points), settings.max_points), thinned(len(source.points), settings.max_points)
    matrix = target_from_source.matrix()
    control = rest.corner, rest.spacing
    _bend(target.surface, source.surface, there, here, matrix, gates, control, nodes, weights)
    return rest.displaced(nodes)


def fit_bent(
    target: PreparedMap,
    source: PreparedMap,
    target_from_source: Similarity2,
    bend: Bend,
    scale: ScaleRange,
    settings: ElasticSettings = ElasticSettings(),
) -> Similarity2:
    """Fit one transform, by least squares, to the walls of the source that the bend laid on walls of the target.

    Drift distorts a map by more than one transform can follow. The transform that matches most walls then fits one
    part and misses the rest; this one is the mean over all parts, which is also how the ground truth of such a pair is
    defined. Walls that find none, as moved furniture, do not count. ``target_from_source`` is returned if too few do.
    """
    moved = target_from_source.apply(bend.apply(source.points))
    normals = Similarity2(yaw=target_from_source.yaw).apply(source.normals)
    _, distance = nearest_points(target.surface, moved, normals)
    near = settings.matched_share * smaller_diagonal(target, source, target_from_source.scale)
    matched = distance <= max(settings.min_matched_cells * max(1.0, target_from_source.scale), near)
    if np.count_nonzero(matched) < settings.min_points:
        return target_from_source
    return fit_similarity(moved[matched], source.points[matched], scale) or target_from_source


@njit(cache=True)
def _bend(
    target: Surface,
    source: Surface,
    there: tuple[NDArray[np.intp], float],
    here: tuple[NDArray[np.intp], float],
    matrix: Vector,
    gates: Vector,
    control: Control,
    nodes: Nodes,
    weights: Weights,
) -> None:
    """Move the nodes in place, by one step for each gate [cells of the source]."""
    for gate in gates:
        band, right = np.zeros((nodes.size, 4 * nodes.shape[1] + 1)), np.zeros(nodes.size)
        paired = _pair_source(target, source, here, matrix, gate, control, nodes, weights[2], band, right)
        paired += _pair_target(target, source, there, matrix, gate, control, nodes, weights[2], band, right)
        if paired == 0.0:
            return
        band /= paired
        right /= paired
        _add_strain(nodes, control[1], weights[0], band, right)
        _add_curvature(nodes, control[1], weights[1], band, right)
        band[:, 0] += 1e-9  # without common walls a rigid motion is free
        if not _solve(band, right):
            return
        nodes += right.reshape(nodes.shape)


@njit(cache=True)
def _pair_source(
    target: Surface,
    source: Surface,
    here: tuple[NDArray[np.intp], float],
    matrix: Vector,
    gate: float,
    control: Control,
    nodes: Nodes,
    line_weight: float,
    band: Band,
    right: Vector,
) -> float:
    """Add the equations of the source's points and their nearest on the target; return the sum of the weights."""
    scale = math.hypot(matrix[0, 0], matrix[1, 0])
    c, s = matrix[0, 0] / scale, matrix[1, 0] / scale
    paired = 0.0
    for k in here[0]:
        px, py, ax, ay = source[0][k, 0], source[0][k, 1], source[1][k, 0], source[1][k, 1]
        dx, dy = displacement(px, py, control[0], control[1], nodes)
        bx, by = px + dx, py + dy
        x = matrix[0, 0] * bx + matrix[0, 1] * by + matrix[0, 2]
        y = matrix[1, 0] * bx + matrix[1, 1] * by + matrix[1, 2]
        index, distance = nearest_point(target, x, y, c * ax - s * ay, s * ax + c * ay)
        if not distance < gate * scale:
            continue
        ex, ey = (target[0][index, 0] - x) / scale, (target[0][index, 1] - y) / scale
        qx, qy = target[1][index, 0], target[1][index, 1]
        nx, ny = c * qx + s * qy, -s * qx + c * qy
        weight = here[1] * pair_weight(distance / (gate * scale), normal_cosine(ax, ay, nx, ny))
        error = (c * ex + s * ey, -s * ex + c * ey)
        _add_pair((px, py), error, (nx, ny), weight, line_weight, control, nodes, band, right)
        paired += weight
    return paired


@njit(cache=True)
def _pair_target(
    target: Surface,
    source: Surface,
    there: tuple[NDArray[np.intp], float],
    matrix: Vector,
    gate: float,
    control: Control,
    nodes: Nodes,
    line_weight: float,
    band: Band,
    right: Vector,
) -> float:
    """Add the equations of the target's points and their nearest on the bent source; return the sum of the weights."""
    scale = math.hypot(matrix[0, 0], matrix[1, 0])
    c, s = matrix[0, 0] / scale, matrix[1, 0] / scale
    paired = 0.0
    for k in there[0]:
        qx, qy = (target[0][k, 0] - matrix[0, 2]) / scale, (target[0][k, 1] - matrix[1, 2]) / scale
        x, y = c * qx + s * qy, -s * qx + c * qy
        nx, ny = c * target[1][k, 0] + s * target[1][k, 1], -s * target[1][k, 0] + c * target[1][k, 1]
        bx, by = place_before(x, y, control[0], control[1], nodes)
        index, distance = nearest_point(source, bx, by, nx, ny)
        if not distance < gate:
            continue
        px, py = source[0][index, 0], source[0][index, 1]
        cosine = normal_cosine(nx, ny, source[1][index, 0], source[1][index, 1])
        weight = there[1] / scale * pair_weight(distance / gate, cosine)
        dx, dy = displacement(px, py, control[0], control[1], nodes)
        error = (x - px - dx, y - py - dy)
        _add_pair((px, py), error, (nx, ny), weight, line_weight, control, nodes, band, right)
        paired += weight
    return paired


@njit(cache=True)
def _add_pair(
    point: tuple[float, float],
    error: tuple[float, float],
    normal: tuple[float, float],
    weight: float,
    line_weight: float,
    control: Control,
    nodes: Nodes,
    band: Band,
    right: Vector,
) -> None:
    """Add the equations of one pair: ``error`` is missing at a point of the source, before it is bent."""
    row, col, a, b = element(point[0], point[1], control[0], control[1], nodes)
    first = 2 * (row * nodes.shape[1] + col)
    unknowns = (first, first + 2, first + 2 * nodes.shape[1], first + 2 * nodes.shape[1] + 2)
    shares = ((1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b)
    on_line, in_plane = weight * line_weight, weight * (1.0 - line_weight)
    xx = on_line * normal[0] * normal[0] + in_plane
    xy = on_line * normal[0] * normal[1]
    yy = on_line * normal[1] * normal[1] + in_plane
    for i in range(4):
        k = unknowns[i]
        right[k] += shares[i] * (xx * error[0] + xy * error[1])
        right[k + 1] += shares[i] * (xy * error[0] + yy * error[1])
        for j in range(i + 1):
            share, apart = shares[i] * shares[j], k - unknowns[j]
            band[k, apart] += share * xx
            band[k + 1, apart] += share * yy
            band[k + 1, apart + 1] += share * xy
            if i != j:
                band[k, apart - 1] += share * xy


@njit(cache=True)
def _add_strain(nodes: Nodes, spacing: float, weight: float, band: Band, right: Vector) -> None:
    """Add the mean over all elements of the squared strain: stretch along the edges, and shear at the middle."""
    rows, cols = nodes.shape[0], nodes.shape[1]
    each = weight / ((rows - 1) * (cols - 1))
    edge, shear = np.array([-1.0, 1.0]) / spacing, np.empty(8)
    ends, corners = np.empty(2, np.int64), np.empty(8, np.int64)
    for i in range(4):
        shear[2 * i] = (-1.0 if i < 2 else 1.0) / (4.0 * spacing)
        shear[2 * i + 1] = (-1.0 if i % 2 == 0 else 1.0) / (4.0 * spacing)
    for row in range(rows - 1):
        for col in range(cols - 1):
            for i in range(4):
                corners[2 * i] = 2 * ((row + i // 2) * cols + col + i % 2)
                corners[2 * i + 1] = corners[2 * i] + 1
            for side in range(2):
                ends[0], ends[1] = corners[4 * side], corners[4 * side + 2]
                _add_square(ends, edge, each / 2.0, nodes, band, right)
                ends[0], ends[1] = corners[2 * side + 1], corners[4 + 2 * side + 1]
                _add_square(ends, edge, each / 2.0, nodes, band, right)
            _add_square(corners, shear, 2.0 * each, nodes, band, right)


@njit(cache=True)
def _add_curvature(nodes: Nodes, spacing: float, weight: float, band: Band, right: Vector) -> None:
    """Add the mean over all nodes of the squared second difference, along both axes."""
    rows, cols = nodes.shape[0], nodes.shape[1]
    each, second = weight / (rows * cols), np.array([1.0, -2.0, 1.0]) / spacing
    three = np.empty(3, np.int64)
    for row in range(rows):
        for col in range(cols):
            for component in range(2):
                k = 2 * (row * cols + col) + component
                if 0 < col < cols - 1:
                    three[0], three[1], three[2] = k - 2, k, k + 2
                    _add_square(three, second, each, nodes, band, right)
                if 0 < row < rows - 1:
                    three[0], three[1], three[2] = k - 2 * cols, k, k + 2 * cols
                    _add_square(three, second, each, nodes, band, right)


@njit(cache=True)
def _add_square(
    unknowns: NDArray[np.int64], factors: Vector, weight: float, nodes: Nodes, band: Band, right: Vector
) -> None:
    """Add ``weight`` times the square of the sum of factor times unknown, about the present values."""
    values, cols = 0.0, nodes.shape[1]
    for i in range(len(unknowns)):
        node = unknowns[i] // 2
        values += factors[i] * nodes[node // cols, node % cols, unknowns[i] % 2]
    for i in range(len(unknowns)):
        right[unknowns[i]] -= weight * factors[i] * values
        for j in range(len(unknowns)):
            if unknowns[j] <= unknowns[i]:
                band[unknowns[i], unknowns[i] - unknowns[j]] += weight * factors[i] * factors[j]


@njit(cache=True)
def _solve(band: Band, right: Vector) -> bool:
    """Solve a banded system by Cholesky, in place; return False if it is not positive definite.

    Compiled here rather than called from LAPACK, whose last bits depend on the processor.
    """
    size, width = band.shape
    for i in range(size):
        first = max(0, i - width + 1)
        for j in range(first, i):
            for k in range(max(first, j - width + 1), j):
                band[i, i - j] -= band[i, i - k] * band[j, j - k]
            band[i, i - j] /= band[j, 0]
            band[i, 0] -= band[i, i - j] ** 2
            right[i] -= band[i, i - j] * right[j]
        if band[i, 0] <= 0.0:
            return False
        band[i, 0] = math.sqrt(band[i, 0])
        right[i] /= band[i, 0]
    for i in range(size - 1, -1, -1):
        right[i] /= band[i, 0]
        for j in range(max(0, i - width + 1), i):
            right[j] -= band[i, i - j] * right[i]
    return True
