"""From a transform that is nearly right to the one that fits best."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.alignment.icp import icp_batch
from merge.preparation.prepared_map import PreparedMap
from merge.verification.wall_overlap import measure_wall_overlap, tolerance_cells

SAME_SCORE = 0.005
"""A difference that thinning and rounding make."""


@dataclass(frozen=True)
class CoarseToFineSettings:
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
    target: PreparedMap,
    source: PreparedMap,
    start: Similarity2,
    scale: ScaleRange,
    settings: CoarseToFineSettings = CoarseToFineSettings(),
) -> Similarity2:
    """Improve ``target_from_source`` (cells) by Gauss-Newton on surface points paired with their nearest, both ways.

    Source: ``icp_batch``, pairs that face opposite ways dropped, weights falling to zero at a gate that
    shrinks. On bent maps a tight gate locks onto one
    part, so of the answers at three gates the one whose walls agree best is kept, the tightest of equals; ``start``
    itself where none is better.
    """
    answers = _descend(target, source, start, scale, settings)
    scores = [measure_wall_overlap(target, source, answer, settings.most_points).score for answer in (start, *answers)]
    best = max(scores) - SAME_SCORE
    if max(scores[1:], default=0.0) < scores[0] - SAME_SCORE:
        return start
    return next(answer for answer, score in zip((*answers[::-1], start), scores[::-1], strict=False) if score >= best)


def pattern_search(
    target: PreparedMap,
    source: PreparedMap,
    start: Similarity2,
    scale: ScaleRange,
    settings: CoarseToFineSettings = CoarseToFineSettings(),
) -> Similarity2:
    """Improve ``target_from_source`` (cells) by trying small moves and keeping those whose walls agree better.

    What bends a map moves its parts by more than a gate can hold; the agreement itself, which counts walls within the
    tolerance, is then the better guide. Source: pattern search (Hooke and Jeeves 1961). Crisp maps stay as they are.
    """
    answer, centre = start, source.middle
    points = settings.most_points // 2
    best = measure_wall_overlap(target, source, start, points).score
    step = tolerance_cells(target, source, start.scale) / 2.0
    arm = max(start.scale * source.diagonal / 4.0, 1.0)
    for _ in range(settings.climbs):
        moved = False
        for move in _moves(step, arm, scale.fixed):
            there = _shifted(answer, move, centre, scale)
            score = measure_wall_overlap(target, source, there, points).score
            if score > best + SAME_SCORE / 2.0:
                answer, best, moved = there, score, True
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
    """The answer shifted, turned and grown (x, y, yaw, log scale) about where it lays a point of the source."""
    growth = scale.clip(answer.scale * math.exp(float(move[3]))) / answer.scale
    turn = Similarity2(yaw=float(move[2]), scale=growth)
    there = answer.apply(centre)
    x, y = there + move[:2] - turn.apply(there)
    return Similarity2(float(x), float(y), turn.yaw, growth) @ answer


def _descend(
    target: PreparedMap, source: PreparedMap, start: Similarity2, scale: ScaleRange, settings: CoarseToFineSettings
) -> list[Similarity2]:
    """The answers at a wide, a middle and the last gate."""
    answer, answers = start, []
    for gates in _gates(target, source, start.scale, settings):
        (answer,) = icp_batch(target, source, [answer], gates[None, :], scale, settings.most_points)
        answers.append(answer)
    return answers


def _gates(
    target: PreparedMap, source: PreparedMap, scale: float, settings: CoarseToFineSettings
) -> list[NDArray[np.float64]]:
    """From the first to the last, cut where an answer is kept."""
    tolerance = tolerance_cells(target, source, scale)
    last = settings.last_gate_cells * max(1.0, scale)
    first = settings.first_gate_share * min(target.diagonal, scale * source.diagonal)
    steps = max(0, math.ceil(math.log(max(first, last) / last) / -math.log(settings.shrink)))
    gates = np.array([max(last, first * settings.shrink**k) for k in range(steps)] + [last] * settings.last_steps)
    wide, middle = int((gates >= 2.0 * tolerance).sum()), int((gates >= tolerance).sum())
    return [part for part in np.split(gates, (wide, middle)) if len(part)]
