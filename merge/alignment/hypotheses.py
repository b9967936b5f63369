"""Proposals become candidates: measured, thinned to a short list, refined, and told apart."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.alignment.coarse_to_fine import CoarseToFineSettings, pattern_search, refine
from merge.alignment.deduplication import SAME_SHARE, apart, merged
from merge.alignment.icp import icp_batch
from merge.alignment.patchwise_alignment import align_patchwise
from merge.preparation.prepared_map import PreparedMap, smaller_diagonal
from merge.records.proposal import Proposal
from merge.verification.wall_overlap import TOLERANCE_SHARES, WallOverlap, measure_wall_overlap_by_tolerance

ROUGH_POINTS = 200
ROUGH_GATE_SHARES = np.geomspace(0.08, 0.012, 8)
"""How far apart walls may lie and still be one, as shares of the smaller map's diagonal: proposals lie that far off."""

GLANCE_POINTS = 400
CAREFUL_POINTS = 4000
SHORT_LIST = 16
SECOND_BEST = 8
SECOND_BEST_FINALISTS = 3
QUICK = CoarseToFineSettings(most_points=500, last_steps=3)
DISTINCT_SHARE = 0.06
"""Answers that put the source's surface further apart than this share of the smaller map's diagonal are rivals."""


CRISP = 0.98
"""Where this share of the judged walls agrees there is nothing to mend, and the closest fit is the best."""

FAR_BELOW = 0.35
"""A rival that agrees by so much less takes nothing from an answer, climb as it may."""

BENT_SHARE = 0.004
"""Where the mean over patches lies further than this share of the diagonal from the best match, the maps are bent."""

WORSE = 0.05
"""How much less walls may agree under that mean."""

BORNE = 0.85
"""A tolerance is borne where some candidate agrees by it with this share of what the best agrees by the loosest."""


@dataclass(frozen=True)
class Hypothesis:
    """A refined proposal, cells to cells, and how the walls lie under it, by every tolerance, loosest first."""

    target_from_source: Similarity2
    laid: tuple[WallOverlap, ...]
    proposal: Proposal

    @property
    def walls(self) -> WallOverlap:
        """By the loosest tolerance."""
        return self.laid[0]


def candidates(
    target: PreparedMap, source: PreparedMap, proposals: Sequence[Proposal], scale: ScaleRange
) -> list[Hypothesis]:
    """Distinct answers, refined quickly, the one whose walls agree best first.

    Proposals that say the same are counted and merged, moved to the walls nearby, and those that look best there
    refined.
    """
    return _short_list(target, source, proposals, scale, SHORT_LIST)


def finished(
    target: PreparedMap, source: PreparedMap, found: Sequence[Hypothesis], scale: ScaleRange, best: float = 0.0
) -> list[Hypothesis]:
    """Those candidates refined with care, the one whose walls agree best first.

    ``best`` is a score that was reached elsewhere: what lies far below it is not worth the last of the care.
    """
    polished: list[Hypothesis] = []
    for candidate in found:
        polished.append(_polished(target, source, candidate, scale, best - FAR_BELOW))
        best = max(best, polished[-1].walls.score)
    return distinct(target, source, polished)


def refine_second_best(
    target: PreparedMap,
    source: PreparedMap,
    answer: Hypothesis,
    proposals: Sequence[Proposal],
    scale: ScaleRange,
) -> list[Hypothesis]:
    """Refine the best of the proposals that are to compete with an answer, best first."""
    short_list = _short_list(target, source, proposals, scale, SECOND_BEST)[:SECOND_BEST_FINALISTS]
    return finished(target, source, short_list, scale, answer.walls.score)


def _short_list(
    target: PreparedMap, source: PreparedMap, proposals: Sequence[Proposal], scale: ScaleRange, most: int
) -> list[Hypothesis]:
    rough = [_measured(target, source, p, GLANCE_POINTS) for p in _settled_roughly(target, source, proposals, scale)]
    rough.sort(key=lambda candidate: -candidate.walls.score)
    short_list = _one_a_place(target, source, rough, SAME_SHARE)[:most]
    return distinct(target, source, [_refined(target, source, c, scale, QUICK) for c in short_list])


def _settled_roughly(
    target: PreparedMap, source: PreparedMap, proposals: Sequence[Proposal], scale: ScaleRange
) -> list[Proposal]:
    """Proposals that say the same merged, and each moved to the walls nearby: how well it fits there is seen only
    then."""
    different = merged(target, source, proposals)
    starts = [p.target_from_source for p in different]
    sizes = np.array([[smaller_diagonal(target, source, start.scale)] for start in starts])
    ends = icp_batch(target, source, starts, sizes * ROUGH_GATE_SHARES, scale, ROUGH_POINTS) if starts else []
    return [dataclasses.replace(p, target_from_source=end) for p, end in zip(different, ends, strict=True)]


def sharpest(found: Sequence[Hypothesis]) -> int:
    """The tightest tolerance that the maps bear, as an index into ``TOLERANCE_SHARES``.

    Bent maps bear only the loosest. Crisp ones are judged as sharply as they are drawn, so that a wing which only
    resembles the right one is told from it.
    """
    best = [max((c.laid[level].score for c in found), default=0.0) for level in range(len(TOLERANCE_SHARES))]
    return max(level for level, score in enumerate(best) if score >= BORNE * best[0])


def best_first(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Candidates by agreement, at the tightest tolerance that the maps bear."""
    level = sharpest(found)
    return sorted(found, key=lambda candidate: -candidate.laid[level].score)


def distinct(target: PreparedMap, source: PreparedMap, found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The best candidate of each place, best first; those that ended in the same place become its votes."""
    return _one_a_place(target, source, best_first(found), DISTINCT_SHARE)


def _one_a_place(
    target: PreparedMap, source: PreparedMap, ranked: Sequence[Hypothesis], share: float
) -> list[Hypothesis]:
    proposals = [dataclasses.replace(c.proposal, target_from_source=c.target_from_source) for c in ranked]
    kept = merged(target, source, proposals, share)
    by_place = {id(p.target_from_source): p for p in kept}
    return [
        dataclasses.replace(c, proposal=by_place[id(c.target_from_source)])
        for c in ranked
        if id(c.target_from_source) in by_place
    ]


def is_distinct(target: PreparedMap, source: PreparedMap, best: Hypothesis, other: Hypothesis) -> bool:
    """Whether the two put the source elsewhere."""
    between = float(apart(source, [best.target_from_source, other.target_from_source])[0, 1])
    return between > DISTINCT_SHARE * smaller_diagonal(target, source, best.target_from_source.scale)


def settled(target: PreparedMap, source: PreparedMap, best: Hypothesis, scale: ScaleRange, level: int) -> Hypothesis:
    """The mean over all patches in place of the best match of one part, where the maps are bent."""
    if best.walls.inlier_length > CRISP * best.walls.compared_length:
        return best
    answer = align_patchwise(target, source, best.target_from_source, scale)
    moved = float(apart(source, [best.target_from_source, answer])[0, 1])
    laid = measure_wall_overlap_by_tolerance(target, source, answer, CAREFUL_POINTS)
    if (
        moved < BENT_SHARE * smaller_diagonal(target, source, answer.scale)
        or laid[level].score < best.laid[level].score - WORSE
    ):
        return best
    return dataclasses.replace(best, target_from_source=answer, laid=laid)


def _measured(target: PreparedMap, source: PreparedMap, proposal: Proposal, most_points: int) -> Hypothesis:
    laid = measure_wall_overlap_by_tolerance(target, source, proposal.target_from_source, most_points)
    return Hypothesis(proposal.target_from_source, laid, proposal)


def _refined(
    target: PreparedMap, source: PreparedMap, candidate: Hypothesis, scale: ScaleRange, settings: CoarseToFineSettings
) -> Hypothesis:
    answer = refine(target, source, candidate.target_from_source, scale, settings)
    laid = measure_wall_overlap_by_tolerance(target, source, answer, settings.most_points)
    return dataclasses.replace(candidate, target_from_source=answer, laid=laid)


def _polished(
    target: PreparedMap, source: PreparedMap, candidate: Hypothesis, scale: ScaleRange, least: float
) -> Hypothesis:
    answer = refine(target, source, candidate.target_from_source, scale)
    laid = measure_wall_overlap_by_tolerance(target, source, answer, CAREFUL_POINTS)
    if laid[0].inlier_length <= CRISP * laid[0].compared_length and laid[0].score >= least:
        answer = pattern_search(target, source, answer, scale)
        laid = measure_wall_overlap_by_tolerance(target, source, answer, CAREFUL_POINTS)
    return dataclasses.replace(candidate, target_from_source=answer, laid=laid)
