"""Refinement of one transform: ICP from a wide gate to a narrow one, and pattern search on the score."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.alignment.icp import icp_batch
from merge.alignment.settings import AlignmentSettings, CoarseToFineSettings
from merge.preparation.prepared_map import PreparedMap, smaller_diagonal
from merge.verification.wall_overlap import mean_score, measure_wall_overlap_by_tolerance, tolerance_cells


def refine(
    target: PreparedMap,
    source: PreparedMap,
    start: Similarity2,
    scale: ScaleRange,
    schedule: CoarseToFineSettings = CoarseToFineSettings(),
    settings: AlignmentSettings = AlignmentSettings(),
) -> Similarity2:
    """Refine ``target_from_source`` (cells) by ICP with a gate that narrows.

    On distorted maps a narrow gate locks onto one part. So of the transforms at three gates the one with the best
    mean score is returned, the last of equals; ``start`` itself if none is better.
    """
    answers = _at_three_gates(target, source, start, scale, schedule, settings)
    scores = [_mean_score(target, source, answer, schedule.max_points, settings) for answer in (start, *answers)]
    best = max(scores) - schedule.min_gain
    if max(scores[1:], default=0.0) < scores[0] - schedule.min_gain:
        return start
    return next(answer for answer, score in zip((*answers[::-1], start), scores[::-1], strict=False) if score >= best)


def pattern_search(
    target: PreparedMap,
    source: PreparedMap,
    start: Similarity2,
    scale: ScaleRange,
    schedule: CoarseToFineSettings = CoarseToFineSettings(),
    settings: AlignmentSettings = AlignmentSettings(),
) -> Similarity2:
    """Refine ``target_from_source`` (cells) by small steps in each parameter, as long as the mean score rises.

    Distortion moves parts of a map by more than a narrow gate of ICP; the score, which counts all walls within a
    tolerance, is then the better objective. The mean over the tolerances does not give up a sharp fit for a few more
    walls that fit loosely. Source: pattern search (Hooke and Jeeves 1961).
    """

    def score_of(transform: Similarity2) -> float:
        return _mean_score(target, source, transform, schedule.max_points // 2, settings)

    answer, best = start, score_of(start)
    step = tolerance_cells(target, source, start.scale, settings.overlap) / 2.0
    arm = max(start.scale * source.diagonal / 4.0, 1.0)
    for _ in range(schedule.search_rounds):
        moved = False
        for change in _changes(step, arm, scale.fixed):
            candidate = _change_about(answer, change, source.middle, scale)
            score = score_of(candidate)
            if score > best + schedule.min_gain / 2.0:
                answer, best, moved = candidate, score, True
        step = step if moved else step / 2.0
    return answer


def _mean_score(
    target: PreparedMap, source: PreparedMap, answer: Similarity2, max_points: int, settings: AlignmentSettings
) -> float:
    return mean_score(measure_wall_overlap_by_tolerance(target, source, answer, max_points, settings.overlap))


def _changes(step: float, arm: float, fixed: bool) -> list[NDArray[np.float64]]:
    """List the changes (4,) of x, y, yaw and log scale that move the walls by about ``step``, both ways."""
    sizes = (step, step, step / arm, step / arm)[: 3 if fixed else 4]
    return [
        np.array([sign * size if k == axis else 0.0 for k in range(4)])
        for axis, size in enumerate(sizes)
        for sign in (1.0, -1.0)
    ]


def _change_about(
    transform: Similarity2, change: NDArray[np.float64], point: NDArray[np.float64], scale: ScaleRange
) -> Similarity2:
    """Shift, rotate and scale a transform by ``change`` (x, y, yaw, log scale) about the image of a source point."""
    factor = scale.clip(transform.scale * math.exp(float(change[3]))) / transform.scale
    move = Similarity2(float(change[0]), float(change[1]), float(change[2]), factor)
    return move.about(transform.apply(point)) @ transform


def _at_three_gates(
    target: PreparedMap,
    source: PreparedMap,
    start: Similarity2,
    scale: ScaleRange,
    schedule: CoarseToFineSettings,
    settings: AlignmentSettings,
) -> list[Similarity2]:
    """Return the transforms at a wide, a middle and the last gate."""
    answer, answers = start, []
    for gates in _gates(target, source, start.scale, schedule, settings):
        (answer,) = icp_batch(target, source, [answer], gates[None, :], scale, schedule.max_points, settings.icp)
        answers.append(answer)
    return answers


def _gates(
    target: PreparedMap,
    source: PreparedMap,
    scale: float,
    schedule: CoarseToFineSettings,
    settings: AlignmentSettings,
) -> list[NDArray[np.float64]]:
    """List the gates [target cells], split at twice the tolerance and at the tolerance."""
    tolerance = tolerance_cells(target, source, scale, settings.overlap)
    last = schedule.last_gate_cells * max(1.0, scale)
    first = schedule.first_gate_share * smaller_diagonal(target, source, scale)
    steps = max(0, math.ceil(math.log(max(first, last) / last) / -math.log(schedule.shrink)))
    gates = np.array([max(last, first * schedule.shrink**k) for k in range(steps)] + [last] * schedule.last_steps)
    wide, middle = int((gates >= 2.0 * tolerance).sum()), int((gates >= tolerance).sum())
    return [part for part in np.split(gates, (wide, middle)) if len(part)]
