"""The merge of two maps, step by step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mapping.similarity2 import Similarity2
from merge.cells import compare_cells
from merge.chart import Chart
from merge.decision import Decision, decide
from merge.proposer import Proposal, Proposer
from merge.refinement import refine
from merge.result import Evidence
from merge.scale_range import ScaleRange
from merge.walls import Walls, compare_walls

NOTHING_PROPOSED = "nothing was proposed"
TOO_LITTLE_STRUCTURE = "too little structure"
MIN_SURFACE_POINTS = 20

SHORT_LIST = 8
RIVAL_DISTANCE_SHARE = 0.06
"""Answers that put the source's surface further apart than this share of the smaller map's diagonal are rivals."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """A map as the merger holds it: its chart, and what the method found on it."""

    chart: Chart
    description: Any


@dataclass(frozen=True)
class Candidate:
    """A refined proposal, cells to cells, and how the walls lie under it."""

    target_from_source: Similarity2
    walls: Walls
    proposal: Proposal


@dataclass(frozen=True)
class PairAnswer:
    """The best candidate, cells to cells, with its evidence, and the decision. None where nothing was proposed."""

    target_from_source: Similarity2 | None
    evidence: Evidence | None
    decision: Decision


def merge_pair(
    target: Sheet, source: Sheet, scale: ScaleRange, proposer: Proposer[Any], rng: np.random.Generator
) -> PairAnswer:
    """Propose, verify, refine, decide. ``scale`` in cells of the target per cell of the source."""
    if min(len(target.chart.points), len(source.chart.points)) < MIN_SURFACE_POINTS:
        return PairAnswer(None, None, Decision(False, 0.0, TOO_LITTLE_STRUCTURE))
    proposals = proposer.propose(target.description, source.description, scale, rng)
    candidates = _candidates(target.chart, source.chart, proposals, scale)
    if not candidates:
        return PairAnswer(None, None, Decision(False, 0.0, NOTHING_PROPOSED))
    best = candidates[0]
    rivals = [other for other in candidates if _distinct(target.chart, source.chart, best, other)]
    evidence = _evidence(target.chart, source.chart, best, max((r.walls.agreement for r in rivals), default=0.0))
    return PairAnswer(best.target_from_source, evidence, decide(evidence))


def _candidates(target: Chart, source: Chart, proposals: tuple[Proposal, ...], scale: ScaleRange) -> list[Candidate]:
    rough = [
        Candidate(p.target_from_source, compare_walls(target, source, p.target_from_source, 1000), p) for p in proposals
    ]
    short_list = sorted(rough, key=_rank)[:SHORT_LIST]
    refined = []
    for candidate in short_list:
        answer = refine(target, source, candidate.target_from_source, scale)
        refined.append(Candidate(answer, compare_walls(target, source, answer), candidate.proposal))
    return sorted(refined, key=_rank)


def _rank(candidate: Candidate) -> float:
    return -candidate.walls.agreement


def _distinct(target: Chart, source: Chart, a: Candidate, b: Candidate) -> bool:
    points = source.points
    apart = np.hypot(*(a.target_from_source.apply(points) - b.target_from_source.apply(points)).T).mean()
    size = min(target.diagonal, a.target_from_source.scale * source.diagonal)
    return bool(apart > RIVAL_DISTANCE_SHARE * size)


def _evidence(target: Chart, source: Chart, best: Candidate, rival_agreement: float) -> Evidence:
    cells = compare_cells(target.grid, source.grid, best.target_from_source)
    walls = best.walls
    return Evidence(
        acceptance_index=cells.acceptance_index,
        walls_on_walls=walls.on_walls / walls.judged if walls.judged > 0.0 else None,
        walls_in_free=walls.in_free / walls.judged if walls.judged > 0.0 else None,
        common_known_cells=cells.known,
        overlap=cells.overlap,
        matched_walls_cells=walls.on_walls,
        spread=walls.spread,
        agreement=walls.agreement,
        rival_agreement=rival_agreement,
        matches=best.proposal.matches,
        inliers=best.proposal.inliers,
    )
