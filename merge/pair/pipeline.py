"""The pipeline of one pair: propose, align, verify, accept or refuse."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.alignment.hypotheses import (
    Hypothesis,
    are_distinct,
    compensate_distortion,
    distinct,
    refine_proposals,
    refine_second_best,
    refine_with_care,
    tightest_tolerance,
)
from merge.pair.feature_cache import MapFeatures
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.proposer import Proposer
from merge.proposers.second_best import second_best_proposals
from merge.records.evidence import Evidence
from merge.records.pair_answer import Alternative, PairAnswer
from merge.records.proposal import Proposal
from merge.records.verdict import Reason, Verdict
from merge.settings import MergeSettings
from merge.verification.acceptance import decide, margin
from merge.verification.cell_overlap import compare_cells
from merge.verification.uncertainty import uncertainty


def merge_pair(
    target: MapFeatures,
    source: MapFeatures,
    scale: ScaleRange,
    proposers: Sequence[Proposer[Any]],
    rng: np.random.Generator,
    settings: MergeSettings = MergeSettings(),
) -> PairAnswer:
    """Merge two maps; ask the next proposer only while no answer is certain.

    ``scale`` is in cells of the target per cell of the source. ``proposers`` are those that described the features, or
    the first of them.
    """
    maps, finalists = (target.prepared, source.prepared), settings.alignment.hypotheses.finalists
    answer = PairAnswer(None, None, Verdict.refuse(Reason.NOTHING_PROPOSED))
    if _has_little_structure(*maps, settings):
        return PairAnswer(None, None, Verdict.refuse(Reason.LITTLE_STRUCTURE))
    rough: list[Hypothesis] = []
    found: list[Hypothesis] = []
    stages = list(zip(proposers, target.descriptions, source.descriptions, strict=False))
    for number, (proposer, there, here) in enumerate(stages, start=1):
        proposals = proposer.propose(there, here, scale, rng)
        refined = refine_proposals(*maps, proposals, scale, settings.alignment)
        rough = distinct(*maps, [*rough, *refined], settings.alignment)
        if not rough or (number < len(stages) and rough[0].overlap.score < settings.pair.promising_score):
            continue
        careful = refine_with_care(*maps, rough[:finalists], scale, settings.alignment)
        found = distinct(*maps, [*found, *careful], settings.alignment)
        rough = rough[finalists:]
        answer = _best_answer(*maps, found, scale, settings)
        if answer.score >= settings.acceptance.min_score:
            found = _with_second_best(*maps, found, scale, settings)
            answer = _best_answer(*maps, found, scale, settings)
        if answer.evidence is not None and _is_certain(answer.evidence, settings):
            break
    return answer


def merge_pair_near(
    target: MapFeatures,
    source: MapFeatures,
    guesses: Sequence[Similarity2],
    scale: ScaleRange,
    settings: MergeSettings = MergeSettings(),
) -> PairAnswer:
    """Merge two maps near given transforms, cells to cells; no transform far away makes the answer ambiguous."""
    maps = target.prepared, source.prepared
    if _has_little_structure(*maps, settings):
        return PairAnswer(None, None, Verdict.refuse(Reason.LITTLE_STRUCTURE))
    rough = refine_proposals(*maps, [Proposal(guess) for guess in guesses], scale, settings.alignment)
    finalists = rough[: settings.alignment.hypotheses.finalists]
    return _best_answer(*maps, refine_with_care(*maps, finalists, scale, settings.alignment), scale, settings)


def _has_little_structure(target: PreparedMap, source: PreparedMap, settings: MergeSettings) -> bool:
    return min(len(target.points), len(source.points)) < settings.pair.min_wall_points


def _is_certain(evidence: Evidence, settings: MergeSettings) -> bool:
    return evidence.score >= settings.pair.sure_score and margin(evidence) >= settings.acceptance.margin_cap


def _with_second_best(
    target: PreparedMap, source: PreparedMap, found: Sequence[Hypothesis], scale: ScaleRange, settings: MergeSettings
) -> list[Hypothesis]:
    """Add the best transforms elsewhere, so that they compete with the best hypothesis."""
    proposals = second_best_proposals(target, source, found[0].target_from_source, settings.proposers.second_best)
    others = refine_second_best(target, source, found[0], proposals, scale, settings.alignment)
    return distinct(target, source, [*found, *others], settings.alignment)


def _best_answer(
    target: PreparedMap, source: PreparedMap, found: Sequence[Hypothesis], scale: ScaleRange, settings: MergeSettings
) -> PairAnswer:
    """Verify the best hypothesis, and accept or refuse it."""
    alignment = settings.alignment
    level = tightest_tolerance(found, alignment)
    best = compensate_distortion(target, source, found[0], scale, level, alignment)
    others = [
        Alternative(other.target_from_source, other.overlaps[level].score)
        for other in found
        if are_distinct(target, source, best, other, alignment)
    ]
    others.sort(key=lambda other: -other.score)
    answer = best.target_from_source
    uncertain = uncertainty(target, source, answer, scale, settings.uncertainty, alignment.overlap)
    second_best = others[0].score if others else 0.0
    evidence = _evidence(target, source, best, level, second_best, uncertain.precision_probability)
    verdict = decide(evidence, settings.acceptance)
    return PairAnswer(answer, evidence, verdict, uncertain, tuple(others[: settings.pair.alternatives]))


def _evidence(
    target: PreparedMap,
    source: PreparedMap,
    best: Hypothesis,
    level: int,
    second_best_score: float,
    precision_probability: float,
) -> Evidence:
    cells = compare_cells(target.grid, source.grid, best.target_from_source)
    walls = best.overlaps[level]
    return Evidence(
        acceptance_index=cells.acceptance_index,
        wall_inlier_ratio=walls.inlier_ratio,
        free_space_violation=walls.violation_ratio,
        deep_free_space_violation=best.overlap.violation_ratio,
        common_known_cells=cells.known,
        overlap=cells.overlap,
        inlier_length_cells=walls.inlier_length,
        tolerance_cells=walls.tolerance,
        normal_isotropy=walls.normal_isotropy,
        score=walls.score,
        second_best_score=second_best_score,
        precision_probability=precision_probability,
        matches=best.proposal.matches,
        inliers=best.proposal.inliers,
        votes=best.proposal.votes,
    )
