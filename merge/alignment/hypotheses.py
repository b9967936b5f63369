"""From the proposals of a method to a few refined hypotheses, ranked by their scores."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.alignment.coarse_to_fine import pattern_search, refine
from merge.alignment.deduplication import deduplicate, rms_displacement
from merge.alignment.elastic import bend_onto, fit_bent
from merge.alignment.icp import icp_batch
from merge.alignment.settings import AlignmentSettings, ElasticSettings
from merge.preparation.prepared_map import PreparedMap, smaller_diagonal
from merge.progress import track
from merge.records.bend import Bend
from merge.records.proposal import Proposal
from merge.verification.wall_overlap import WallOverlap, mean_score, measure_wall_overlap_by_tolerance


@dataclass(frozen=True)
class Hypothesis:
    """A refined proposal, cells to cells, and the overlap of the walls under it, by tolerance, loosest first."""

    target_from_source: Similarity2
    overlaps: tuple[WallOverlap, ...]
    proposal: Proposal

    @property
    def overlap(self) -> WallOverlap:
        """Overlap by the loosest tolerance."""
        return self.overlaps[0]

    @property
    def mean_score(self) -> float:
        """Mean of the scores over all tolerances."""
        return mean_score(self.overlaps)


@dataclass(frozen=True, eq=False)
class BentHypothesis:
    """A hypothesis, cells to cells, after the source was bent onto the target.

    ``bend`` remains after the transform; ``rigid`` and ``bent`` are the overlaps of the walls by tolerance, loosest
    first, under the transform alone and after the bend.
    """

    target_from_source: Similarity2
    bend: Bend
    rigid: tuple[WallOverlap, ...]
    bent: tuple[WallOverlap, ...]
    proposal: Proposal

    def scores(self, settings: ElasticSettings = ElasticSettings()) -> list[float]:
        """Return the alignment scores after the bend, by tolerance, each less the cost of the strain, at least 0.

        A right place becomes sharp by little bending; a wrong one stays blurred or needs much.
        """
        cost = settings.strain_cost * self.bend.strain
        return [max(0.0, overlap.score - cost) for overlap in self.bent]

    def score(self, settings: ElasticSettings = ElasticSettings()) -> float:
        """Return the mean of the scores over all tolerances."""
        return float(np.mean(self.scores(settings)))

    def tightest_tolerance(self, settings: AlignmentSettings = AlignmentSettings()) -> int:
        """Return the index of the tightest tolerance that the walls meet after the bend.

        Maps of two visits, or drawn by hand, meet only the loosest. Crisp maps are judged as sharply as they are drawn,
        so that the right room is distinguished from one that only resembles it.
        """
        scores = self.scores(settings.elastic)
        least = settings.hypotheses.min_tolerance_score * scores[0]
        return max(level for level, score in enumerate(scores) if score >= least)


def rank_proposals(
    target: PreparedMap,
    source: PreparedMap,
    proposals: Sequence[Proposal],
    scale: ScaleRange,
    settings: AlignmentSettings = AlignmentSettings(),
) -> list[Hypothesis]:
    """Move proposals to the walls nearby by a few coarse steps, and return those that remain distinct, best first.

    Their scores are measured on few points.
    """
    limits = settings.hypotheses
    rough = [
        Hypothesis(
            proposal.target_from_source,
            _measure(target, source, proposal.target_from_source, limits.ranking_points, settings),
            proposal,
        )
        for proposal in track(_move_to_walls(target, source, proposals, scale, settings), "proposals")
    ]
    rough.sort(key=lambda hypothesis: -hypothesis.overlap.score)
    return _deduplicate(target, source, rough, limits.same_share)


def refine_proposals(
    target: PreparedMap,
    source: PreparedMap,
    proposals: Sequence[Proposal],
    scale: ScaleRange,
    settings: AlignmentSettings = AlignmentSettings(),
) -> list[Hypothesis]:
    """Refine the best proposals quickly, and return distinct hypotheses, the best first.

    Proposals that are nearly the same become one. Each is moved to the walls nearby, because only there its score
    shows how well it fits; then the best are refined.
    """
    return _refine_best(target, source, proposals, scale, settings.hypotheses.refined, settings)


def refine_second_best(
    target: PreparedMap,
    source: PreparedMap,
    answer: Hypothesis,
    proposals: Sequence[Proposal],
    scale: ScaleRange,
    settings: AlignmentSettings = AlignmentSettings(),
) -> list[Hypothesis]:
    """Refine the proposals that compete with an answer, the best of them with care, best first."""
    most = settings.hypotheses
    quick = _refine_best(target, source, proposals, scale, most.refined_second_best, settings)
    return refine_with_care(target, source, quick[: most.second_best_finalists], scale, settings, answer.overlap.score)


def refine_with_care(
    target: PreparedMap,
    source: PreparedMap,
    hypotheses: Sequence[Hypothesis],
    scale: ScaleRange,
    settings: AlignmentSettings = AlignmentSettings(),
    best_score: float = 0.0,
) -> list[Hypothesis]:
    """Refine hypotheses with care, and return the distinct ones, best first.

    ``best_score`` was reached elsewhere: hypotheses far below it skip the pattern search.
    """
    refined: list[Hypothesis] = []
    for hypothesis in track(hypotheses, "finalists"):
        least = best_score - settings.hypotheses.hopeless_gap
        refined.append(_refine_with_care(target, source, hypothesis, scale, settings, least))
        best_score = max(best_score, refined[-1].overlap.score)
    return distinct(target, source, refined, settings)


def ranked(hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Sort hypotheses by the mean of their scores over all tolerances, best first."""
    return sorted(hypotheses, key=lambda hypothesis: -hypothesis.mean_score)


def distinct(
    target: PreparedMap,
    source: PreparedMap,
    hypotheses: Sequence[Hypothesis],
    settings: AlignmentSettings = AlignmentSettings(),
) -> list[Hypothesis]:
    """Keep the best hypothesis of each place, best first; the others become its votes."""
    return _deduplicate(target, source, ranked(hypotheses), settings.hypotheses.distinct_share)


def are_distinct(
    target: PreparedMap,
    source: PreparedMap,
    one: BentHypothesis,
    other: BentHypothesis,
    settings: AlignmentSettings = AlignmentSettings(),
) -> bool:
    """Test if two hypotheses put the source at different places."""
    shift = float(rms_displacement(source, [one.target_from_source, other.target_from_source])[0, 1])
    diagonal = smaller_diagonal(target, source, one.target_from_source.scale)
    return shift > settings.hypotheses.distinct_share * diagonal


def bend_hypothesis(
    target: PreparedMap,
    source: PreparedMap,
    hypothesis: Hypothesis,
    scale: ScaleRange,
    settings: AlignmentSettings = AlignmentSettings(),
) -> BentHypothesis:
    """Bend the source onto the target from a hypothesis, and fit its transform to the bent walls.

    It is left as it is if that scores no less: crisp maps with little in common fit best without any bend.
    """
    start, points = hypothesis.target_from_source, settings.hypotheses.final_points
    bend = bend_onto(target, source, start, settings.elastic)
    answer = fit_bent(target, source, start, bend, scale, settings.elastic)
    rest, bend = bend.displaced(np.zeros_like(bend.nodes)), bend.relative_to(start.inverse() @ answer)
    before, rigid = (_measure(target, source, place, points, settings) for place in (start, answer))
    bent = measure_wall_overlap_by_tolerance(target, source, answer, points, settings.overlap, bend)
    candidates = (
        BentHypothesis(start, rest, before, before, hypothesis.proposal),
        BentHypothesis(answer, bend, rigid, bent, hypothesis.proposal),
    )
    return max(candidates, key=lambda candidate: candidate.score(settings.elastic))


def _refine_best(
    target: PreparedMap,
    source: PreparedMap,
    proposals: Sequence[Proposal],
    scale: ScaleRange,
    most: int,
    settings: AlignmentSettings,
) -> list[Hypothesis]:
    best = rank_proposals(target, source, proposals, scale, settings)[:most]
    refined = [_refine_quickly(target, source, each, scale, settings) for each in track(best, "hypotheses")]
    return distinct(target, source, refined, settings)


def _move_to_walls(
    target: PreparedMap,
    source: PreparedMap,
    proposals: Sequence[Proposal],
    scale: ScaleRange,
    settings: AlignmentSettings,
) -> list[Proposal]:
    """Merge proposals that are nearly the same, and move each to the walls nearby by a few coarse steps of ICP."""
    limits = settings.hypotheses
    different = deduplicate(target, source, proposals, limits.same_share)
    if not different:
        return []
    starts = [proposal.target_from_source for proposal in different]
    diagonals = np.array([[smaller_diagonal(target, source, start.scale)] for start in starts])
    gates = diagonals * np.geomspace(limits.first_gate_share, limits.last_gate_share, limits.gates)
    ends = icp_batch(target, source, starts, gates, scale, limits.coarse_points, settings.icp)
    return [dataclasses.replace(p, target_from_source=end) for p, end in zip(different, ends, strict=True)]


def _deduplicate(
    target: PreparedMap, source: PreparedMap, hypotheses: Sequence[Hypothesis], share: float
) -> list[Hypothesis]:
    proposals = [dataclasses.replace(h.proposal, target_from_source=h.target_from_source) for h in hypotheses]
    kept = {id(p.target_from_source): p for p in deduplicate(target, source, proposals, share)}
    return [
        dataclasses.replace(h, proposal=kept[id(h.target_from_source)])
        for h in hypotheses
        if id(h.target_from_source) in kept
    ]


def _refine_quickly(
    target: PreparedMap, source: PreparedMap, hypothesis: Hypothesis, scale: ScaleRange, settings: AlignmentSettings
) -> Hypothesis:
    answer = refine(target, source, hypothesis.target_from_source, scale, settings.quick, settings)
    overlaps = _measure(target, source, answer, settings.quick.max_points, settings)
    return dataclasses.replace(hypothesis, target_from_source=answer, overlaps=overlaps)


def _refine_with_care(
    target: PreparedMap,
    source: PreparedMap,
    hypothesis: Hypothesis,
    scale: ScaleRange,
    settings: AlignmentSettings,
    least_score: float,
) -> Hypothesis:
    points = settings.hypotheses.final_points
    answer = refine(target, source, hypothesis.target_from_source, scale, settings.careful, settings)
    overlaps = _measure(target, source, answer, points, settings)
    if not _is_crisp(overlaps[0], settings) and overlaps[0].score >= least_score:
        answer = pattern_search(target, source, answer, scale, settings.careful, settings)
        overlaps = _measure(target, source, answer, points, settings)
    return dataclasses.replace(hypothesis, target_from_source=answer, overlaps=overlaps)


def _is_crisp(overlap: WallOverlap, settings: AlignmentSettings) -> bool:
    return overlap.inlier_length > settings.hypotheses.crisp_ratio * overlap.compared_length


def _measure(
    target: PreparedMap, source: PreparedMap, answer: Similarity2, points: int, settings: AlignmentSettings
) -> tuple[WallOverlap, ...]:
    return measure_wall_overlap_by_tolerance(target, source, answer, points, settings.overlap)
