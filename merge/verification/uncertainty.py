"""Covariance of an answer, from the residuals of the walls under it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.preparation.prepared_map import PreparedMap, smaller_diagonal
from merge.preparation.surface import nearest_points, thinned
from merge.records.pair_answer import Uncertainty
from merge.verification.settings import UncertaintySettings, WallOverlapSettings
from merge.verification.wall_overlap import tolerance_cells


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Paired points of both surfaces, in cells of the target: place (N, 2) about the answer's centre, residual (N, 2),
    normal (N, 2) and weight (N,)."""

    arms: NDArray[np.float64]
    errors: NDArray[np.float64]
    normals: NDArray[np.float64]
    weights: NDArray[np.float64]


def uncertainty(
    target: PreparedMap,
    source: PreparedMap,
    answer: Similarity2,
    scale: ScaleRange,
    settings: UncertaintySettings = UncertaintySettings(),
    overlap: WallOverlapSettings = WallOverlapSettings(),
) -> Uncertainty:
    """Estimate the uncertainty of a refined answer from the residuals of the walls under it.

    The errors of neighbouring walls are dependent, because drift moves all walls of a patch together. So the maps are
    cut into patches, each with a shift of its own; the variance of these shifts is pooled over the patches
    (cluster-robust covariance: Liang and Zeger 1986, with a common variance). Every wall cell adds the rounding of the
    raster. A direction in which no wall holds the answer, as along a bare corridor, gets the variance of the map's
    size.
    """
    centre = answer.apply(source.middle)
    gate = settings.gate_tolerances * tolerance_cells(target, source, answer.scale, overlap)
    pairs = _pair_walls(target, source, answer, centre, gate, settings.max_points)
    diagonal = smaller_diagonal(target, source, answer.scale)
    log_scale = settings.log_scale_sigma
    loose = np.array([1.0 / diagonal**2, 1.0 / diagonal**2, 1.0 / math.pi**2, 1.0 / log_scale**2])
    unknowns = 3 if scale.fixed else 4
    information = np.diag(loose)
    if len(pairs.weights):
        information += _information(pairs, settings.patch_share * diagonal, max(1.0, answer.scale), settings)
    covariance = np.zeros((4, 4))
    covariance[:unknowns, :unknowns] = np.linalg.inv(information[:unknowns, :unknowns])
    return Uncertainty(centre, covariance)


def _pair_walls(
    target: PreparedMap,
    source: PreparedMap,
    answer: Similarity2,
    centre: NDArray[np.float64],
    gate: float,
    max_points: int,
) -> _Pairs:
    """Pair every wall point of either map with its nearest on the other."""
    there = _nearest(target, source, answer, gate, max_points)
    back = _nearest(source, target, answer.inverse(), gate / answer.scale, max_points)
    on_target = np.concatenate((there.below, back.above))
    on_source = np.concatenate((there.above, back.below))
    moved, ends = answer.apply(source.points[on_source]), target.points[on_target]
    normals = np.concatenate((target.normals[there.below], _rotated(source.normals[back.below], answer)))
    weights = np.concatenate((answer.scale * there.weights, back.weights)) / 2.0
    return _Pairs(moved - centre, ends - moved, normals, weights)


@dataclass(frozen=True, eq=False)
class _OneWay:
    """Indices (N,) of points above and of their nearest below, and the weight of each pair."""

    above: NDArray[np.intp]
    below: NDArray[np.intp]
    weights: NDArray[np.float64]


def _nearest(
    below: PreparedMap, above: PreparedMap, below_from_above: Similarity2, gate: float, max_points: int
) -> _OneWay:
    kept, weight = thinned(len(above.points), max_points)
    normals = _rotated(above.normals[kept], below_from_above)
    index, distance = nearest_points(below.surface, below_from_above.apply(above.points[kept]), normals)
    near = distance < gate
    cosine = (normals[near] * below.normals[index[near]]).sum(axis=1)
    reach = distance[near] / gate
    return _OneWay(kept[near], index[near], weight * (1.0 - reach**2) ** 2 * np.maximum(cosine, 0.0))


def _rotated(normals: NDArray[np.float64], by: Similarity2) -> NDArray[np.float64]:
    return Similarity2(yaw=by.yaw).apply(normals)


def _information(pairs: _Pairs, side: float, coarser: float, settings: UncertaintySettings) -> NDArray[np.float64]:
    """Invert the covariance (4, 4) of x, y, yaw and log scale, without a prior.

    ``side`` of a patch and ``coarser``, that of a cell of the coarser map, in cells of the target.
    """
    patch = _patches(pairs.arms, side)
    normals = _straightened(pairs, settings.min_normal_isotropy)
    moves = np.column_stack((normals, _cross(pairs.arms, normals), (pairs.arms * normals).sum(axis=1)))
    residuals = (pairs.errors * normals).sum(axis=1)
    hessians = _summed(patch, pairs.weights[:, None, None] * moves[:, :, None] * moves[:, None, :])
    gradients = _summed(patch, (pairs.weights * residuals)[:, None] * moves)
    hessian = hessians.sum(axis=0)
    shifts = hessians[:, :, :2]
    pooled = _pooled(gradients[:, :2], hessians[:, :2, :2])
    variance = settings.variance_inflation * pooled + (settings.patch_sigma_cells * coarser) ** 2
    scatter = variance * np.einsum("pik,pjk->ij", shifts, shifts) + (settings.cell_sigma_cells * coarser) ** 2 * hessian
    ridge = 1e-9 * np.diag(np.diag(scatter)) + 1e-12 * np.eye(4)
    return np.asarray(hessian @ np.linalg.solve(scatter + ridge, hessian))


def _patches(points: NDArray[np.float64], side: float) -> NDArray[np.intp]:
    squares = np.floor(points / side).astype(np.int64)
    _, patch = np.unique(squares, axis=0, return_inverse=True)
    return np.asarray(patch.ravel(), np.intp)


def _straightened(pairs: _Pairs, min_isotropy: float) -> NDArray[np.float64]:
    """Return the normals; if all walls are parallel, one normal and its opposite for all."""
    outer = (pairs.weights[:, None] * pairs.normals).T @ pairs.normals
    lengths, axes = np.linalg.eigh(outer)
    if lengths[0] >= min_isotropy * lengths.sum():
        return pairs.normals
    along = pairs.normals @ axes[:, 1]
    return np.asarray(np.sign(along)[:, None] * axes[:, 1])


def _cross(arms: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(arms[:, 0] * normals[:, 1] - arms[:, 1] * normals[:, 0])


def _summed(patch: NDArray[np.intp], values: NDArray[np.float64]) -> NDArray[np.float64]:
    total = np.zeros((int(patch.max()) + 1, *values.shape[1:]))
    np.add.at(total, patch, values)
    return total


def _pooled(gradients: NDArray[np.float64], hessians: NDArray[np.float64]) -> float:
    """Estimate the variance of a patch's own shift along x or y: shifts of that variance explain the gradients.

    The answer itself was fitted to the patches, so two of them are lost as degrees of freedom.
    """
    expected = float((hessians**2).sum())
    patches = len(gradients)
    if expected == 0.0:
        return 0.0
    return float((gradients**2).sum()) / expected * patches / max(1, patches - 2)
