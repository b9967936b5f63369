"""One transform for maps that are bent: every patch of walls is laid on by itself, and all of them vote."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from merge.alignment.correspondences import add_equations
from merge.alignment.icp import LINE_SHARE
from merge.preparation.prepared_map import PreparedMap, smaller_diagonal
from merge.preparation.surface import nearest_points

PATCH_SHARE = 0.15
"""Side of a patch, as a share of the smaller map's diagonal: what drift bends is nearly rigid over so little."""

GATES = (0.05, 0.04, 0.03, 0.025, 0.02, 0.015, 0.015)
"""How far apart two walls may lie and still be paired, step by step, as shares of the smaller map's diagonal."""

STIFFNESS = 0.1
"""How much a patch is held where the whole map puts it, against how its walls hold it."""

MIN_POINTS = 12


def align_patchwise(
    target: PreparedMap, source: PreparedMap, answer: Similarity2, scale: ScaleRange, rounds: int = 2
) -> Similarity2:
    """The least-squares ``target_from_source`` (cells) of all patches of the source, each moved to fit by itself.

    Drift bends a map by more than one transform can follow. The one that matches most walls then fits one part and
    leaves the rest; the one wanted is the mean over all, which is also how the truth of such a pair is defined.
    ``answer`` itself where too little fits.
    """
    for _ in range(rounds):
        on_source, on_target = _laid_patches(target, source, answer)
        if len(on_source) < MIN_POINTS:
            return answer
        answer = fit_similarity(on_target, on_source, scale) or answer
    return answer


def _laid_patches(
    target: PreparedMap, source: PreparedMap, answer: Similarity2
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    diagonal = smaller_diagonal(target, source, answer.scale)
    on_source, on_target = [np.empty((0, 2))], [np.empty((0, 2))]
    for members in _patches(source, PATCH_SHARE * diagonal / answer.scale):
        local = _settled(target, source, answer, members, diagonal)
        if local is None:
            continue
        hit = members[_near(target, source, local, members, GATES[-1] * diagonal)]
        if 2 * len(hit) > len(members):
            on_source.append(source.points[hit])
            on_target.append(local.apply(source.points[hit]))
    return np.concatenate(on_source), np.concatenate(on_target)


def _patches(source: PreparedMap, side: float) -> list[NDArray[np.intp]]:
    cells = np.floor((source.points - source.middle) / side).astype(np.int64)
    _, patch = np.unique(cells, axis=0, return_inverse=True)
    order = np.argsort(patch.ravel(), kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(patch.ravel()[order])) + 1)
    return [part for part in parts if len(part) >= MIN_POINTS]


def _settled(
    target: PreparedMap, source: PreparedMap, answer: Similarity2, members: NDArray[np.intp], diagonal: float
) -> Similarity2 | None:
    """The answer, shifted and turned so that the patch lies on the target's walls; None where none are near."""
    local, middle = answer, source.points[members].mean(axis=0)
    arm = PATCH_SHARE * diagonal / 2.0
    for share in GATES:
        equations = np.zeros((4, 5))
        centre = local.apply(middle)
        pairs = add_equations(
            target.surface,
            source.surface,
            members,
            1.0,
            local.matrix(),
            share * diagonal,
            LINE_SHARE,
            centre,
            equations,
        )
        if 3 * pairs < len(members):
            return None
        hold = STIFFNESS * pairs * np.array([1.0, 1.0, arm**2])
        away = answer.apply(middle) - centre
        turn = math.remainder(answer.yaw - local.yaw, math.tau)
        gradient = equations[:3, 4] + hold * np.array([away[0], away[1], turn])
        x, y, yaw = np.linalg.solve(equations[:3, :3] + np.diag(hold), gradient).tolist()
        local = _about(centre, x, y, yaw) @ local
    return local


def _about(centre: NDArray[np.float64], x: float, y: float, yaw: float) -> Similarity2:
    there = centre + np.array([x, y]) - Similarity2(yaw=yaw).apply(centre)
    return Similarity2(float(there[0]), float(there[1]), yaw)


def _near(
    target: PreparedMap, source: PreparedMap, local: Similarity2, members: NDArray[np.intp], gate: float
) -> NDArray[np.bool_]:
    points, normals = local.apply(source.points[members]), Similarity2(yaw=local.yaw).apply(source.normals[members])
    _, distances = nearest_points(target.surface, points, normals)
    return np.asarray(distances <= gate)
