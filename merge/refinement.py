"""From a transform that is nearly right to the one that fits best."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.similarity2 import Similarity2
from merge.chart import Chart
from merge.laying import add_equations, add_equations_back
from merge.scale_range import ScaleRange
from merge.walls import compare_walls, thinned, tolerance_cells

SAME_AGREEMENT = 0.005
"""A difference that thinning and rounding make."""

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
    climbs: int = 6

    def __post_init__(self) -> None:
        for name in ("first_gate_share", "last_gate_cells", "last_steps", "most_points", "climbs"):
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
    best = max(agreements) - SAME_AGREEMENT
    if max(agreements[1:], default=0.0) < agreements[0] - SAME_AGREEMENT:
        return start
    return next(
        answer
        for answer, agreement in zip((*answers[::-1], start), agreements[::-1], strict=False)
        if agreement >= best
    )


def climb(
    target: Chart,
    source: Chart,
    start: Similarity2,
    scale: ScaleRange,
    settings: RefinementSettings = RefinementSettings(),
) -> Similarity2:
    """Improve ``target_from_source`` (cells) by trying small moves and keeping those whose walls agree better.

    What bends a map moves its parts by more than a gate can hold; the agreement itself, which counts walls within the
    tolerance, is then the better guide. Source: pattern search (Hooke and Jeeves 1961). Crisp maps stay as they are.
    """
    answer, centre = start, source.middle
    points = settings.most_points // 2
    best = compare_walls(target, source, start, points).agreement
    step = tolerance_cells(target, source, start.scale) / 2.0
    arm = max(start.scale * source.diagonal / 4.0, 1.0)
    for _ in range(settings.climbs):
        moved = False
        for move in _moves(step, arm, scale.fixed):
            there = _shifted(answer, move, centre, scale)
            agreement = compare_walls(target, source, there, points).agreement
            if agreement > best + SAME_AGREEMENT / 2.0:
                answer, best, moved = there, agreement, True
        step = step if moved else step / 2.0
    return answer


def _moves(step: float, arm: float, fixed: bool) -> list[NDArray[np.float64]]:
    sizes = (step, step, step / arm, step / arm)[: 3 if fixed else 4]
    return [
        np.array([sign * size if k == axis else 0.0 for k in range(4)])
        for axis, size in enumerate(sizes)
        for sign in (1.0, -1.0)
    ]


def _shifted(
    answer: Similarity2, move: NDArray[np.float64], centre: NDArray[np.float64], scale: ScaleRange
) -> Similarity2:
    return _moved(answer, move, answer.apply(centre), scale) or answer


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
    matrix, inverse = answer.matrix(), answer.inverse().matrix()
    on_source, weight = thinned(len(source.points), most_points)
    on_target, back_weight = thinned(len(target.points), most_points)
    if not len(on_source):
        return None
    centre = answer.apply(source.middle)
    equations = np.zeros((4, 5))
    pairs = add_equations(
        target.surface, source.surface, on_source, weight * answer.scale, matrix, gate, LINE_SHARE, centre, equations
    )
    gate = gate / answer.scale
    pairs += add_equations_back(
        target.surface, source.surface, on_target, back_weight, matrix, inverse, gate, LINE_SHARE, centre, equations
    )
    unknowns = 3 if scale.fixed else 4
    if pairs < unknowns:
        return None
    try:
        step = np.linalg.solve(equations[:unknowns, :unknowns], equations[:unknowns, 4]).astype(np.float64)
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
