"""The merge of two maps, step by step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.alignment.hypotheses import (
    Hypothesis,
    candidates,
    distinct,
    finished,
    is_distinct,
    refine_second_best,
    settled,
    sharpest,
)
from merge.pair.feature_cache import MapFeatures
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.proposer import Proposer
from merge.proposers.second_best import second_best_proposals
from merge.records.pair_answer import Alternative, PairAnswer
from merge.records.proposal import Proposal
from merge.records.result import Evidence
from merge.records.verdict import Reason, Verdict
from merge.verification.acceptance import AcceptanceSettings, decide, margin
from merge.verification.cell_overlap import compare_cells
from merge.verification.uncertainty import uncertainty

MIN_SURFACE_POINTS = 20
FINALISTS = 4
PROMISING = 0.25
"""What agrees less, refined quickly, is not worth more before the next proposer has had its say."""

SURE_SCORE = 0.45
"""An answer that agrees so well, and leaves its rivals far behind, needs no further proposals."""

ALTERNATIVES = 3
"""So many other places are told."""


def merge_pair(
    target: MapFeatures,
    source: MapFeatures,
    scale: ScaleRange,
    proposers: Sequence[Proposer[Any]],
    rng: np.random.Generator,
    settings: AcceptanceSettings = AcceptanceSettings(),  # noqa: B008
) -> PairAnswer:
    """Propose, verify, refine, decide; the next proposer is asked only where no answer is sure yet.

    ``scale`` in cells of the target per cell of the source. ``proposers`` are those that described the sheets, or the
    first of them.
    """
    answer = PairAnswer(None, None, Verdict.refuse(Reason.NOTHING_PROPOSED))
    if min(len(target.chart.points), len(source.chart.points)) < MIN_SURFACE_POINTS:
        return PairAnswer(None, None, Verdict.refuse(Reason.LITTLE_STRUCTURE))
    charts = target.chart, source.chart
    rough: list[Hypothesis] = []
    found: list[Hypothesis] = []
    stages = list(zip(proposers, target.descriptions, source.descriptions, strict=False))
    for number, (proposer, there, here) in enumerate(stages, start=1):
        proposals = proposer.propose(there, here, scale, rng)
        rough = distinct(*charts, [*rough, *candidates(*charts, proposals, scale)])
        if not rough or (number < len(stages) and rough[0].walls.score < PROMISING):
            continue
        found = distinct(*charts, [*found, *finished(*charts, rough[:FINALISTS], scale)])
        rough = rough[FINALISTS:]
        answer = _best(*charts, found, scale, settings)
        if answer.score >= settings.min_score:
            others = second_best_proposals(*charts, found[0].target_from_source)
            found = distinct(*charts, [*found, *refine_second_best(*charts, found[0], others, scale)])
            answer = _best(*charts, found, scale, settings)
        if answer.evidence is not None and _is_sure(answer.evidence, settings):
            break
    return answer


def _is_sure(evidence: Evidence, settings: AcceptanceSettings) -> bool:
    return evidence.score >= SURE_SCORE and margin(evidence) >= settings.margin_cap


def _best(
    target: PreparedMap,
    source: PreparedMap,
    found: Sequence[Hypothesis],
    scale: ScaleRange,
    settings: AcceptanceSettings,
) -> PairAnswer:
    level = sharpest(found)
    best = settled(target, source, found[0], scale, level)
    others = [
        Alternative(other.target_from_source, other.laid[level].score)
        for other in found
        if is_distinct(target, source, best, other)
    ]
    others.sort(key=lambda other: -other.score)
    exact = uncertainty(target, source, best.target_from_source, scale)
    evidence = _evidence(target, source, best, level, others[0].score if others else 0.0, exact.precision_probability)
    return PairAnswer(
        best.target_from_source,
        evidence,
        decide(evidence, settings),
        exact,
        tuple(others[:ALTERNATIVES]),
    )


def _evidence(
    target: PreparedMap,
    source: PreparedMap,
    best: Hypothesis,
    level: int,
    second_best_score: float,
    precision_probability: float,
) -> Evidence:
    cells = compare_cells(target.grid, source.grid, best.target_from_source)
    walls = best.laid[level]
    return Evidence(
        acceptance_index=cells.acceptance_index,
        wall_inlier_ratio=walls.inlier_ratio,
        free_space_violation=walls.violation_ratio,
        deep_free_space_violation=best.walls.violation_length / best.walls.compared_length
        if best.walls.compared_length > 0.0
        else None,
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


def answer_near(
    target: MapFeatures,
    source: MapFeatures,
    places: Sequence[Similarity2],
    scale: ScaleRange,
    settings: AcceptanceSettings = AcceptanceSettings(),  # noqa: B008
) -> PairAnswer:
    """Verify, refine and decide where it is known from elsewhere that the source lies near one of these places: no
    place far off is its rival."""
    charts = target.chart, source.chart
    if min(len(chart.points) for chart in charts) < MIN_SURFACE_POINTS:
        return PairAnswer(None, None, Verdict.refuse(Reason.LITTLE_STRUCTURE))
    rough = candidates(*charts, [Proposal(place) for place in places], scale)
    found = finished(*charts, rough[:FINALISTS], scale)
    return _best(*charts, found, scale, settings)
