"""Patchwise alignment of distorted maps: every patch of walls is aligned by itself, and one transform fits them all."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from merge.alignment.correspondences import add_equations
from merge.alignment.settings import AlignmentSettings, PatchwiseSettings
from merge.preparation.prepared_map import PreparedMap, smaller_diagonal
from merge.preparation.surface import nearest_points


def align_patchwise(
    target: PreparedMap,
    source: PreparedMap,
    answer: Similarity2,
    scale: ScaleRange,
    settings: AlignmentSettings = AlignmentSettings(),
) -> Similarity2:
    """Fit ``target_from_source`` (cells) by least squares to all patches of the source, each aligned by itself.

    Drift distorts a map by more than one transform can follow. The transform that matches most walls then fits one
    part and misses the rest; this one is the mean over all parts, which is also how the ground truth of such a pair is
    defined. ``answer`` is returned if too few walls match.
    """
    patchwise = settings.patchwise
    for _ in range(patchwise.rounds):
        on_source, on_target = _align_patches(target, source, answer, settings)
        if len(on_source) < patchwise.min_points:
            return answer
        answer = fit_similarity(on_target, on_source, scale) or answer
    return answer


def _align_patches(
    target: PreparedMap, source: PreparedMap, answer: Similarity2, settings: AlignmentSettings
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the matched points (N, 2) of the aligned patches on the source, and where they lie on the target."""
    patchwise = settings.patchwise
    diagonal = smaller_diagonal(target, source, answer.scale)
    on_source, on_target = [np.empty((0, 2))], [np.empty((0, 2))]
    for members in patches(source, patchwise.patch_share * diagonal / answer.scale, patchwise.min_points):
        local = align_patch(target, source, answer, members, diagonal, patchwise, settings.icp.line_weight)
        if local is None:
            continue
        hit = members[_is_near(target, source, local, members, patchwise.gate_shares[-1] * diagonal)]
        if 2 * len(hit) > len(members):
            on_source.append(source.points[hit])
            on_target.append(local.apply(source.points[hit]))
    return np.concatenate(on_source), np.concatenate(on_target)


def patches(source: PreparedMap, side: float, min_points: int) -> list[NDArray[np.intp]]:
    """List the indices of the wall points in each square patch."""
    cells = np.floor((source.points - source.middle) / side).astype(np.int64)
    _, patch = np.unique(cells, axis=0, return_inverse=True)
    order = np.argsort(patch.ravel(), kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(patch.ravel()[order])) + 1)
    return [part for part in parts if len(part) >= min_points]


def align_patch(
    target: PreparedMap,
    source: PreparedMap,
    answer: Similarity2,
    members: NDArray[np.intp],
    diagonal: float,
    settings: PatchwiseSettings,
    line_weight: float,
) -> Similarity2 | None:
    """Shift and rotate the answer so that the patch lies on the target's walls; None if none are near."""
    local, middle = answer, source.points[members].mean(axis=0)
    surfaces = target.surface, source.surface
    arm = settings.patch_share * diagonal / 2.0
    for share in settings.gate_shares:
        equations, centre = np.zeros((4, 5)), local.apply(middle)
        gate = share * diagonal
        pairs = add_equations(*surfaces, members, 1.0, local.matrix(), gate, line_weight, centre, equations)
        if 3 * pairs < len(members):
            return None
        hold = settings.stiffness * pairs * np.array([1.0, 1.0, arm**2])
        offset = answer.apply(middle) - centre
        turn = math.remainder(answer.yaw - local.yaw, math.tau)
        gradient = equations[:3, 4] + hold * np.array([offset[0], offset[1], turn])
        x, y, yaw = np.linalg.solve(equations[:3, :3] + np.diag(hold), gradient).tolist()
        local = Similarity2(x, y, yaw).about(centre) @ local
    return local


def _is_near(
    target: PreparedMap, source: PreparedMap, local: Similarity2, members: NDArray[np.intp], gate: float
) -> NDArray[np.bool_]:
    points, normals = local.apply(source.points[members]), Similarity2(yaw=local.yaw).apply(source.normals[members])
    _, distances = nearest_points(target.surface, points, normals)
    return np.asarray(distances <= gate)
