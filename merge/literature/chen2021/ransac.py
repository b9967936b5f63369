"""RANSAC and acceptance of chapter 4 of Chen 2021."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.records.pair_answer import PairAnswer
from merge.records.verdict import Reason, Refusal, Verdict
from merge.verification.cell_overlap import compare_cells

NO_COMMON_CELL = "the maps have no known cell in common"
MOST_TIMES_LARGER = 10.0
COLLAPSED = f"one map would be more than {MOST_TIMES_LARGER:g} times as large as the other"

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


def accept_by_index(target: OccupancyGrid, source: OccupancyGrid, answer: Similarity2) -> PairAnswer:
    """Accept an answer with its acceptance index as confidence.

    The thesis has no threshold: every answer with common cells is accepted, unless one map would collapse.
    """
    index = compare_cells(target, source, answer).acceptance_index
    collapsed = not 1.0 / MOST_TIMES_LARGER <= answer.scale <= MOST_TIMES_LARGER
    text = NO_COMMON_CELL if index is None else COLLAPSED if collapsed else None
    refusal = None if text is None else Refusal(Reason.PUBLISHED_RULE, text)
    return PairAnswer(answer, None, Verdict(refusal is None, index or 0.0, refusal))
