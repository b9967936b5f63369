"""From a transform that is nearly right to the one that fits best."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.similarity2 import Similarity2
from merge.chart import Chart
from merge.scale_range import ScaleRange
from merge.walls import compare_walls, facing, thinned, tolerance_cells, turned

LINE_SHARE = 0.8
"""Weight of the distance along the normal; the rest is that of the plain distance, which holds ends and corners."""


@dataclass(frozen=True)
class RefinementSettings:
    """The gate (how far apart two points may lie and still be paired) shrinks by ``shrink`` from ``first_gate_share``
    of the smaller map's diagonal to ``last_gate_cells`` cells of the coarser map, then stays for ``last_steps``.
    """

    first_gate_share: float = 0.05
    last_gate_cells: float = 2.0
    shrink: float = 0.8
    last_steps: int = 6
    most_points: int = 2000

    def __post_init__(self) -> None:
        for name in ("first_gate_share", "last_gate_cells", "last_steps", "most_points"):
            if not getattr(self, name) > 0:
                raise ValueError(f"RefinementSettings: {name} is {getattr(self, name)}, must be positive")
        if not 0.0 < self.shrink < 1.0:
            raise ValueError(f"RefinementSettings: shrink is {self.shrink}, must lie in (0, 1)")


def refine(
    target: Chart,
    source: Chart,
    start: Similarity2,
    scale: ScaleRange,
    settings: RefinementSettings = RefinementSettings(),
) -> Similarity2:
    """Improve ``target_from_source`` (cells) by Gauss-Newton on surface points paired with their nearest, both ways.

    Source: iterative closest points (Besl and McKay 1992), point to line (Chen and Medioni 1992), pairs that face
    opposite ways dropped, weights falling to zero at a gate that shrinks. On bent maps a tight gate locks onto one
    part, so of the answers at three gates the one whose walls agree best is kept, the tightest of equals; ``start``
    itself where none is better.
    """
    answers = _descend(target, source, start, scale, settings)
    agreements = [compare_walls(target, source, answer, settings.most_points).agreement for answer in (start, *answers)]
    best = max(agreements) - 0.005  # a difference that thinning and rounding make
    if max(agreements[1:], default=0.0) < agreements[0] - 0.005:
        return start
    return next(
        answer
        for answer, agreement in zip((*answers[::-1], start), agreements[::-1], strict=False)
        if agreement >= best
    )


def _descend(
    target: Chart, source: Chart, start: Similarity2, scale: ScaleRange, settings: RefinementSettings
) -> list[Similarity2]:
    answer, answers = start, []
    for gate, keep in _gates(target, source, start.scale, settings):
        step = _step(target, source, answer, gate, scale, settings.most_points)
        if step is None:
            break
        answer = step
        if keep:
            answers.append(answer)
    return answers


def _gates(target: Chart, source: Chart, scale: float, settings: RefinementSettings) -> list[tuple[float, bool]]:
    tolerance = tolerance_cells(target, source, scale)
    last = settings.last_gate_cells * max(1.0, scale)
    first = settings.first_gate_share * min(target.diagonal, scale * source.diagonal)
    steps = max(0, math.ceil(math.log(max(first, last) / last) / -math.log(settings.shrink)))
    gates = [max(last, first * settings.shrink**k) for k in range(steps)] + [last] * settings.last_steps
    wide = sum(gate >= 2.0 * tolerance for gate in gates) - 1
    middle = sum(gate >= tolerance for gate in gates) - 1
    return [(gate, k in (wide, middle, len(gates) - 1)) for k, gate in enumerate(gates)]


def _step(
    target: Chart, source: Chart, answer: Similarity2, gate: float, scale: ScaleRange, most_points: int
) -> Similarity2 | None:
    there = _pairs(target, source, answer, gate, most_points)
    back = _pairs(source, target, answer.inverse(), gate / answer.scale, most_points)
    on_source = np.concatenate((there.above, back.below))
    on_target = np.concatenate((there.below, back.above))
    normals = np.concatenate((there.normals, turned(back.normals, answer.yaw)))
    weights = np.concatenate((there.weights * answer.scale, back.weights))
    if np.count_nonzero(weights) < 4:
        return None
    return _solve(answer, on_target, on_source, normals, weights, scale)


@dataclass(frozen=True, eq=False)
class _Pairs:
    below: NDArray[np.float64]
    above: NDArray[np.float64]
    normals: NDArray[np.float64]  # of the points below
    weights: NDArray[np.float64]


def _pairs(below: Chart, above: Chart, below_from_above: Similarity2, gate: float, most_points: int) -> _Pairs:
    kept, weight = thinned(len(above.points), most_points)
    index, distance = below.nearest_to(below_from_above.apply(above.points[kept]))
    paired = distance < gate
    index, distance, kept = index[paired], distance[paired], kept[paired]
    cosine = np.maximum(0.0, facing(turned(above.normals[kept], below_from_above.yaw), below.normals[index]))
    weights = weight * (1.0 - (distance / gate) ** 2) ** 2 * cosine
    return _Pairs(below.points[index], above.points[kept], below.normals[index], weights)


def _solve(
    answer: Similarity2,
    on_target: NDArray[np.float64],
    on_source: NDArray[np.float64],
    normals: NDArray[np.float64],
    weights: NDArray[np.float64],
    scale: ScaleRange,
) -> Similarity2 | None:
    moved = answer.apply(on_source)
    centre = np.average(moved, axis=0, weights=weights)
    arm, error = moved - centre, on_target - moved
    # d moved / d (x, y, yaw, log scale), about the centre, where the four hardly disturb one another
    sideways = np.stack((-arm[:, 1], arm[:, 0]), axis=-1)
    along_x, along_y = np.broadcast_to((1.0, 0.0), arm.shape), np.broadcast_to((0.0, 1.0), arm.shape)
    jacobian = np.stack((along_x, along_y, sideways, arm), axis=-1)  # (N, 2, 4)
    unknowns = 3 if scale.fixed else 4
    jacobian = jacobian[..., :unknowns]
    line = np.einsum("ni,nij->nj", normals, jacobian)
    normal_error = (normals * error).sum(axis=1)
    hessian = LINE_SHARE * (line * weights[:, None]).T @ line
    hessian += (1.0 - LINE_SHARE) * np.einsum("nij,n,nik->jk", jacobian, weights, jacobian)
    gradient = LINE_SHARE * line.T @ (weights * normal_error)
    gradient += (1.0 - LINE_SHARE) * np.einsum("nij,n,ni->j", jacobian, weights, error)
    try:
        step = np.linalg.solve(hessian, gradient)
    except np.linalg.LinAlgError:
        return None
    return _moved(answer, step, centre, scale)


def _moved(
    answer: Similarity2, step: NDArray[np.float64], centre: NDArray[np.float64], scale: ScaleRange
) -> Similarity2 | None:
    growth = math.exp(min(max(float(step[3]), -0.1), 0.1)) if len(step) == 4 else 1.0
    growth = scale.clip(answer.scale * growth) / answer.scale
    turn = Similarity2(yaw=float(step[2]), scale=growth)
    x, y = centre + step[:2] - turn.apply(centre)
    if not math.isfinite(float(x) + float(y)):
        return None
    return Similarity2(float(x), float(y), turn.yaw, growth) @ answer
