"""How far an answer may be off."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.preparation.prepared_map import PreparedMap, smaller_diagonal
from merge.preparation.surface import nearest_points
from merge.records.uncertainty import Uncertainty
from merge.verification.wall_overlap import thinned, tolerance_cells

PATCH_SHARE = 0.25
"""Side of a patch, as a share of the smaller map's diagonal: what moves one of its walls moves all of them."""

INFLATION = 8.0
"""Times the variance that the patches show: those of neighbours are not independent, since drift grows along the way.
So set that the mean normalised squared error is about 4, its number of parameters, on generated pairs at noise 1."""

PATCH_NOISE = 0.15
"""By how much, in cells of the coarser map, a patch may lie off though nothing shows it: walls fall between cells."""

CELL_NOISE = 0.3
"""By how much, in cells of the coarser map, each wall cell may lie off by itself: drawing it on a raster does that."""

STRAIGHT = 0.08
"""Where the matched walls face one way but for this share, what they seem to say of shifts along themselves is the
raggedness of their cells; as ``min_normal_isotropy`` in ``AcceptanceSettings``."""

MOST_POINTS = 4000

GATE_TOLERANCES = 2.0
"""How many of the loosest tolerances apart two walls may lie and still be a pair."""

SCALE_PRIOR = math.log(2.0)
"""How far off the scale may be where nothing fixes it."""


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Points of both surfaces that lie on one another, in cells of the target: where (N, 2), about the answer's centre,
    what lies between (N, 2), the normals (N, 2), and how much each counts (N,)."""

    arms: NDArray[np.float64]
    errors: NDArray[np.float64]
    normals: NDArray[np.float64]
    weights: NDArray[np.float64]


def uncertainty(target: PreparedMap, source: PreparedMap, answer: Similarity2, scale: ScaleRange) -> Uncertainty:
    """The uncertainty of a refined answer, from how the walls lie under it.

    The errors of neighbouring walls are not independent: drift moves all walls of a patch together. So the maps are cut
    into patches, what each says for itself is its own shift, whose variance is pooled over patches (cluster-robust
    covariance: Liang and Zeger 1986, with a common variance), and every wall cell adds its rounding. A direction in
    which nothing holds the answer, as along a bare corridor, has the variance of the map's size.
    """
    centre = answer.apply(source.middle)
    pairs = _paired(target, source, answer, centre)
    diagonal = smaller_diagonal(target, source, answer.scale)
    loose = np.array([1.0 / diagonal**2, 1.0 / diagonal**2, 1.0 / math.pi**2, 1.0 / SCALE_PRIOR**2])
    unknowns = 3 if scale.fixed else 4
    information = np.diag(loose)
    if len(pairs.weights):
        information += _information(pairs, PATCH_SHARE * diagonal, max(1.0, answer.scale))
    covariance = np.zeros((4, 4))
    covariance[:unknowns, :unknowns] = np.linalg.inv(information[:unknowns, :unknowns])
    return Uncertainty(centre, covariance)


def _paired(target: PreparedMap, source: PreparedMap, answer: Similarity2, centre: NDArray[np.float64]) -> _Pairs:
    """Every point of either surface with its nearest on the other."""
    gate = GATE_TOLERANCES * tolerance_cells(target, source, answer.scale)
    there = _nearest(target, source, answer, gate)
    back = _nearest(source, target, answer.inverse(), gate / answer.scale)
    on_target = np.concatenate((there.below, back.above))
    on_source = np.concatenate((there.above, back.below))
    laid, ends = answer.apply(source.points[on_source]), target.points[on_target]
    normals = np.concatenate((target.normals[there.below], _turned(source.normals[back.below], answer)))
    weights = np.concatenate((answer.scale * there.weights, back.weights)) / 2.0
    return _Pairs(laid - centre, ends - laid, normals, weights)


@dataclass(frozen=True, eq=False)
class _Laid:
    """Indices (N,) of points above and of their nearest below, and what each pair counts."""

    above: NDArray[np.intp]
    below: NDArray[np.intp]
    weights: NDArray[np.float64]


def _nearest(below: PreparedMap, above: PreparedMap, below_from_above: Similarity2, gate: float) -> _Laid:
    kept, weight = thinned(len(above.points), MOST_POINTS)
    normals = _turned(above.normals[kept], below_from_above)
    index, distance = nearest_points(below.surface, below_from_above.apply(above.points[kept]), normals)
    near = distance < gate
    facing = (normals[near] * below.normals[index[near]]).sum(axis=1)
    reach = distance[near] / gate
    return _Laid(kept[near], index[near], weight * (1.0 - reach**2) ** 2 * np.maximum(facing, 0.0))


def _turned(normals: NDArray[np.float64], by: Similarity2) -> NDArray[np.float64]:
    return Similarity2(yaw=by.yaw).apply(normals)


def _information(pairs: _Pairs, side: float, coarser: float) -> NDArray[np.float64]:
    """Inverse covariance (4, 4) of shift x, y, turn and growth, without what is known beforehand; the side of a patch,
    and of a cell of the coarser map, in cells of the target."""
    patch = _patches(pairs.arms, side)
    normals = _straightened(pairs)
    moves = np.column_stack((normals, _cross(pairs.arms, normals), (pairs.arms * normals).sum(axis=1)))
    residuals = (pairs.errors * normals).sum(axis=1)
    hessians = _summed(patch, pairs.weights[:, None, None] * moves[:, :, None] * moves[:, None, :])
    gradients = _summed(patch, (pairs.weights * residuals)[:, None] * moves)
    hessian = hessians.sum(axis=0)
    shifts = hessians[:, :, :2]
    spread = _pooled(gradients[:, :2], hessians[:, :2, :2])
    variance = INFLATION * spread + (PATCH_NOISE * coarser) ** 2
    scatter = variance * np.einsum("pik,pjk->ij", shifts, shifts) + (CELL_NOISE * coarser) ** 2 * hessian
    ridge = 1e-9 * np.diag(np.diag(scatter)) + 1e-12 * np.eye(4)
    return np.asarray(hessian @ np.linalg.solve(scatter + ridge, hessian))


def _patches(points: NDArray[np.float64], side: float) -> NDArray[np.intp]:
    squares = np.floor(points / side).astype(np.int64)
    _, patch = np.unique(squares, axis=0, return_inverse=True)
    return np.asarray(patch.ravel(), np.intp)


def _straightened(pairs: _Pairs) -> NDArray[np.float64]:
    """The normals, but one and its opposite for all where the walls run one way."""
    outer = (pairs.weights[:, None] * pairs.normals).T @ pairs.normals
    lengths, axes = np.linalg.eigh(outer)
    if lengths[0] >= STRAIGHT * lengths.sum():
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
    """The variance of a patch's own shift along x or y: what shifts of that variance would make of the gradients is
    what they are. A patch more or less is what the answer itself has taken out of them."""
    expected = float((hessians**2).sum())
    patches = len(gradients)
    if expected == 0.0:
        return 0.0
    return float((gradients**2).sum()) / expected * patches / max(1, patches - 2)
