"""The merge of two maps, step by step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
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
    rivals,
    settled,
    sharpest,
)
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.proposer import Proposal, Proposer
from merge.records.reason import Reason
from merge.records.result import Evidence
from merge.verification.acceptance import AcceptanceSettings, Verdict, decide, margin
from merge.verification.cell_overlap import compare_cells
from merge.verification.uncertainty import Uncertainty, uncertainty

MIN_SURFACE_POINTS = 20
FINALISTS = 4
PROMISING = 0.25
"""What agrees less, refined quickly, is not worth more before the next proposer has had its say."""

SURE_SCORE = 0.45
"""An answer that agrees so well, and leaves its rivals far behind, needs no further proposals."""

ALTERNATIVES = 3
"""So many other places are told."""


@dataclass(frozen=True, eq=False)
class MapFeatures:
    """A map as the merger holds it: its chart, and what each proposer of the method found on it."""

    chart: PreparedMap
    descriptions: tuple[Any, ...]


@dataclass(frozen=True)
class Alternative:
    """Another place for the source, cells to cells, and how well the walls agree there (``Evidence``)."""

    target_from_source: Similarity2
    score: float


@dataclass(frozen=True)
class PairAnswer:
    """The best candidate, cells to cells, with its evidence, and the decision. None where nothing was proposed, the
    uncertainty also where a method answered as published. ``alternatives`` lie elsewhere, the best of them first."""

    target_from_source: Similarity2 | None
    evidence: Evidence | None
    verdict: Verdict
    uncertainty: Uncertainty | None = None
    alternatives: tuple[Alternative, ...] = ()

    @property
    def score(self) -> float:
        return 0.0 if self.evidence is None else self.evidence.score

    def inverse(self) -> PairAnswer:
        """The answer for the pair the other way round."""
        answer = self.target_from_source
        if answer is None:
            return self
        return PairAnswer(
            answer.inverse(),
            self.evidence,
            self.verdict,
            None if self.uncertainty is None else self.uncertainty.inverse(answer),
            tuple(Alternative(other.target_from_source.inverse(), other.score) for other in self.alternatives),
        )


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
            found = distinct(*charts, [*found, *rivals(*charts, found[0], scale)])
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
