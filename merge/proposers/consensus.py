"""RANSAC on matched points: similarities with many inliers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity_fit import fit_similarity
from mapping.validation import require_valid
from merge.records.proposal import Proposal


@dataclass(frozen=True)
class ConsensusSettings:
    """RANSAC as in Chen 2021, section 4.4; distances in cells of the coarser map.

    - ``samples``: pairs of matches that are tried, all of them if there are no more;
    - ``inlier_distance_cells``: largest residual of an inlier;
    - ``distinct_cells``: mean displacement of the matched points from which on two hypotheses are distinct;
    - ``proposals``: number of distinct hypotheses that are proposed, of at least ``min_inliers`` inliers each;
    - ``refits``: the samples of most inliers are fitted to their inliers.
    """

    samples: int = 2000
    inlier_distance_cells: float = 5.0
    distinct_cells: float = 10.0
    proposals: int = 16
    min_inliers: int = 3
    refits: int = 400

    def __post_init__(self) -> None:
        require_valid(self)


def consensus(
    target: NDArray[np.float64],
    source: NDArray[np.float64],
    scale: ScaleRange,
    rng: np.random.Generator,
    settings: ConsensusSettings = ConsensusSettings(),
) -> tuple[Proposal, ...]:
    """Propose similarities with many inliers among the matched points (M, 2) of target and source, by
    falling number.

    Source: Fischler and Bolles 1981, two matches a sample. Unlike Chen 2021 the scale is bounded, so that it cannot
    collapse until everything is an inlier; each hypothesis is fitted again to its inliers, and several distinct ones
    are kept. Empty if none has ``min_inliers``.
    """
    if len(source) < settings.min_inliers:
        return ()
    first, second = _samples(len(source), settings.samples, rng)
    p, q = source[:, 0] + 1j * source[:, 1], target[:, 0] + 1j * target[:, 1]
    turn, shift = _similarities(p, q, first, second, scale)
    gate = settings.inlier_distance_cells * np.maximum(1.0, np.abs(turn))
    counts = _count_inliers(p, q, turn, shift, gate)
    found: list[Proposal] = []
    for k in np.argsort(-counts, kind="stable")[: settings.refits]:
        if len(found) == settings.proposals or counts[k] < settings.min_inliers:
            break
        proposal = _refit(target, source, np.abs(turn[k] * p + shift[k] - q) < gate[k], scale, settings)
        if proposal is not None and all(_are_distinct(proposal, other, source, settings) for other in found):
            found.append(proposal)
    return tuple(sorted(found, key=lambda proposal: -(proposal.inliers or 0)))


def _samples(matches: int, samples: int, rng: np.random.Generator) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    if matches * (matches - 1) // 2 <= samples:
        return np.triu_indices(matches, 1)
    first = rng.integers(0, matches, samples)
    return first, (first + rng.integers(1, matches, samples)) % matches


def _similarities(
    p: NDArray[np.complex128],
    q: NDArray[np.complex128],
    first: NDArray[np.intp],
    second: NDArray[np.intp],
    scale: ScaleRange,
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    p_side, q_side = p[second] - p[first], q[second] - q[first]
    usable = (np.abs(p_side) > 0.0) & (np.abs(q_side) > 0.0)
    first, second, p_side, q_side = first[usable], second[usable], p_side[usable], q_side[usable]
    turn = q_side / p_side
    turn *= np.clip(np.abs(turn), scale.low, scale.high) / np.abs(turn)
    shift = (q[first] + q[second] - turn * (p[first] + p[second])) / 2.0
    return turn, shift


@njit(cache=True)
def _count_inliers(
    p: NDArray[np.complex128],
    q: NDArray[np.complex128],
    turn: NDArray[np.complex128],
    shift: NDArray[np.complex128],
    gate: NDArray[np.float64],
) -> NDArray[np.int64]:
    counts = np.zeros(len(turn), np.int64)
    for k in range(len(turn)):
        for i in range(len(p)):
            off = turn[k] * p[i] + shift[k] - q[i]
            if off.real * off.real + off.imag * off.imag < gate[k] * gate[k]:
                counts[k] += 1
    return counts


def _refit(
    target: NDArray[np.float64],
    source: NDArray[np.float64],
    inliers: NDArray[np.bool_],
    scale: ScaleRange,
    settings: ConsensusSettings,
) -> Proposal | None:
    fit = fit_similarity(target[inliers], source[inliers], scale)
    if fit is None:
        return None
    residual = np.hypot(*(fit.apply(source) - target).T)
    count = int((residual < settings.inlier_distance_cells * max(1.0, fit.scale)).sum())
    return Proposal(fit, matches=len(source), inliers=count)


def _are_distinct(a: Proposal, b: Proposal, source: NDArray[np.float64], settings: ConsensusSettings) -> bool:
    displacement = np.hypot(*(a.target_from_source.apply(source) - b.target_from_source.apply(source)).T)
    size = max(1.0, a.target_from_source.scale)
    return bool(displacement.mean() > settings.distinct_cells * size)
