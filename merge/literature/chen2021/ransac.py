"""RANSAC and acceptance of chapter 4 of Chen 2021."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from merge.records.pair_answer import PairAnswer
from merge.records.verdict import Reason, Refusal, Verdict

Complex = NDArray[np.complex128]


def most_inliers(
    target: NDArray[np.float64],
    source: NDArray[np.float64],
    samples: int,
    inlier_distance_cells: float,
    rng: np.random.Generator,
) -> Similarity2 | None:
    """Draw similarities through two matches (M, 2) each, and return the first of most inliers, cells to cells.

    Source: Chen 2021, section 4.4. A match is an inlier if its residual in the target is less than the distance. The
    result is not fitted again, and its scale has no bound: near 0 everything is an inlier. None if no sample has a
    scale at all.
    """
    if len(source) < 2:
        return None
    first = rng.integers(0, len(source), samples)
    second = (first + rng.integers(1, len(source), samples)) % len(source)
    p, q = source[:, 0] + 1j * source[:, 1], target[:, 0] + 1j * target[:, 1]
    p_side, q_side = p[second] - p[first], q[second] - q[first]
    usable = (np.abs(p_side) > 0.0) & (np.abs(q_side) > 0.0)
    if not usable.any():
        return None
    turns = q_side[usable] / p_side[usable]
    shifts = q[first[usable]] - turns * p[first[usable]]
    best = int(np.argmax(_counts(p, q, turns, shifts, inlier_distance_cells)))
    turn, shift = complex(turns[best]), complex(shifts[best])
    return Similarity2(shift.real, shift.imag, math.atan2(turn.imag, turn.real), abs(turn))


@njit(cache=True)
def _counts(p: Complex, q: Complex, turns: Complex, shifts: Complex, distance: float) -> NDArray[np.int64]:
    counts = np.zeros(len(turns), np.int64)
    for k in range(len(turns)):
        for i in range(len(p)):
            if abs(turns[k] * p[i] + shifts[k] - q[i]) < distance:
                counts[k] += 1
    return counts


def accept_by_index(answer: Similarity2, index: float | None, max_scale: float) -> PairAnswer:
    """Accept an answer with its acceptance index as confidence.

    The thesis has no threshold: every answer with common cells is accepted, unless one map would collapse to less than
    1 / ``max_scale`` of the other's size.
    """
    collapsed = not 1.0 / max_scale <= answer.scale <= max_scale
    collapse = f"one map would be more than {max_scale:g} times as large as the other" if collapsed else None
    text = "the maps have no known cell in common" if index is None else collapse
    refusal = None if text is None else Refusal(Reason.PUBLISHED_RULE, text)
    return PairAnswer(answer, None, Verdict(refusal is None, index or 0.0, refusal))
