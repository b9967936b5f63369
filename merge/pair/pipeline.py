"""The pipeline of one pair: propose, align, verify, accept or refuse. ``match`` starts it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import compress
from typing import Any

import numpy as np

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.seeds import Role, stream
from merge.alignment.contradiction import measure_contradiction
from merge.alignment.deduplication import rms_displacement
from merge.alignment.hypotheses import (
    BentHypothesis,
    Hypothesis,
    are_distinct,
    bend_hypothesis,
    distinct,
    refine_proposals,
    refine_second_best,
    refine_with_care,
)
from merge.alignment.settings import AlignmentSettings
from merge.methods import Proposer
from merge.pair.feature_cache import FeatureCache, MapFeatures, metres_from_prepared
from merge.pair.symmetry import HalfTurns, other_placement
from merge.pair.task import CanonicalOrder, PairTask, to_result
from merge.preparation.prepared_map import PreparedMap, smaller_diagonal
from merge.proposers.second_best import second_best_proposals
from merge.records.evidence import Evidence
from merge.records.pair_answer import Alternative, PairAnswer
from merge.records.prior import Expected
from merge.records.proposal import Proposal
from merge.records.result import PairResult
from merge.records.verdict import Reason, Verdict
from merge.settings import MergeSettings
from merge.verification.acceptance import decide, margin
from merge.verification.cell_overlap import compare_cells
from merge.verification.settings import WallOverlapSettings
from merge.verification.uncertainty import uncertainty
from merge.verification.wall_overlap import tolerance_cells


def match(task: PairTask, cache: FeatureCache | None = None) -> PairResult:
    """Match one pair. The answer depends neither on other maps nor on which of the two comes first.

    A refusal says so if the maps fit at a scale that was not searched, or if one of them is mirrored.
    """
    features = task.features(cache)
    answer = _answer(*features, task.in_cells(task.scale, features), task.settings, task.seed)
    unexplained = not task.settings.pair.explains_refusals or task.settings.as_published
    if _fits(answer) or unexplained or answer.score == 0.0:
        return to_result(task, answer, features)
    return to_result(
        task, _at_another_scale(task, features) or _if_mirrored(task, features, answer) or answer, features
    )


def _fits(answer: PairAnswer) -> bool:
    """Return True if the answer is accepted, or would be in a place that is not symmetric."""
    return answer.verdict.accepted or answer.verdict.reason is Reason.SYMMETRIC


def _at_another_scale(task: PairTask, features: tuple[MapFeatures, MapFeatures]) -> PairAnswer | None:
    """Return a refusal that states the scale at which the maps match, if they match at one that was not searched.

    None if they do not. Only the first proposer is asked, to save time.
    """
    answer = _quick_answer(*features, task.in_cells(ScaleRange.widest(), features), task.settings, task.seed)
    if answer is None or not _fits(answer):
        return None
    found = to_result(task, answer, features).target_from_source
    if found is None or abs(math.log(found.scale / task.scale.clip(found.scale))) < task.settings.pair.same_log_scale:
        return None
    if task.scale.fixed and task.settings.scale is None:
        refused = Verdict.refuse(Reason.OTHER_SCALE, detail=f", {found.scale:.3g} times that")
    else:
        searched = f"{task.scale.low:g} to {task.scale.high:g}" if not task.scale.fixed else f"{task.scale.low:g}"
        refused = Verdict.refuse(Reason.OUTSIDE_SCALES, detail=f", {searched}: {found.scale:.3g}")
    return dataclasses.replace(answer, verdict=refused)


def _if_mirrored(task: PairTask, features: tuple[MapFeatures, MapFeatures], answer: PairAnswer) -> PairAnswer | None:
    """Refuse the answer because one map is a mirror image, if they match so; None if they do not.

    The answer competes with the mirrored one, because a symmetric building fits either way.
    """
    target, source = features
    if CanonicalOrder(target.prepared.grid) <= CanonicalOrder(source.prepared.grid):
        source = _mirrored(source, task)
    else:
        target = _mirrored(target, task)
    scale = task.in_cells(task.scale, (target, source))
    mirrored = _quick_answer(target, source, scale, task.settings, task.seed)
    if mirrored is None or mirrored.evidence is None:
        return None
    second_best = max(mirrored.evidence.second_best_score, answer.score)
    competing = dataclasses.replace(mirrored.evidence, second_best_score=second_best)
    if not decide(competing, task.settings.acceptance).accepted:
        return None
    return dataclasses.replace(answer, verdict=Verdict.refuse(Reason.MIRRORED))


def _mirrored(features: MapFeatures, task: PairTask) -> MapFeatures:
    """Return the features of the mirrored map, by the first proposer."""
    grid = features.prepared.grid
    mirrored = PreparedMap(OccupancyGrid(grid.frame, grid.log_odds[:, ::-1]), task.settings.preparation)
    return MapFeatures(mirrored, (task.settings.chosen_proposers[0].describe(mirrored),))


def _quick_answer(
    target: MapFeatures, source: MapFeatures, scale: ScaleRange, settings: MergeSettings, seed: int
) -> PairAnswer | None:
    """Merge the pair by the first proposer; None if nothing that it proposes could be accepted."""
    if CanonicalOrder(target.prepared.grid) > CanonicalOrder(source.prepared.grid):
        swapped = _quick_answer(source, target, scale.inverse(), settings, seed)
        return None if swapped is None else swapped.inverse()
    proposer, maps = settings.chosen_proposers[0], (target.prepared, source.prepared)
    if _has_little_structure(*maps, settings):
        return None
    proposals = proposer.propose(target.descriptions[0], source.descriptions[0], scale, stream(seed, Role.MERGE))
    rough = refine_proposals(*maps, proposals, scale, settings.alignment)
    if not rough or rough[0].overlap.score < settings.pair.competing_score:
        return None
    return _answer(target, source, scale, settings, seed, proposers=1)


@dataclass(frozen=True, eq=False)
class GuidedTask:
    """A pair to match near a ``guess``: target_from_source in metres, or a range of poses that a prior expects.

    ``candidates`` are further guesses of the transform; only those that the prior allows are used.
    """

    pair: PairTask
    guess: Similarity2 | Expected
    candidates: tuple[Similarity2, ...] = ()


def match_near(task: GuidedTask, cache: FeatureCache | None = None) -> PairResult:
    """Match a pair near its guess; other poses with a similar score do not make it ambiguous."""
    pair = task.pair
    features = pair.features(cache, methods=())
    metres = [metres_from_prepared(grid.frame, each.prepared) for grid, each in zip(pair.grids, features, strict=True)]
    scale = pair.in_cells(pair.scale, features)
    if isinstance(task.guess, Expected):
        expected = task.guess
        known = [metres[0].inverse() @ each @ metres[1] for each in task.candidates if expected.allows(each)]
        guesses = [*known, *expected.starts(features[0].prepared.diagonal, *metres)]

        def allows(answer: Similarity2) -> bool:
            return expected.allows(metres[0] @ answer @ metres[1].inverse())

        return to_result(pair, merge_pair_near(*features, guesses, scale, pair.settings, allows), features)
    guess = metres[0].inverse() @ task.guess @ metres[1]
    guess = dataclasses.replace(guess, scale=scale.clip(guess.scale))
    return to_result(pair, merge_pair_near(*features, [guess], scale, pair.settings), features)


def _answer(
    target: MapFeatures,
    source: MapFeatures,
    scale: ScaleRange,
    settings: MergeSettings,
    seed: int,
    proposers: int | None = None,
) -> PairAnswer:
    """Merge the pair in canonical order, by the first ``proposers`` of the method, or all."""
    rng = stream(seed, Role.MERGE)
    if CanonicalOrder(target.prepared.grid) <= CanonicalOrder(source.prepared.grid):
        return _answer_in_order(target, source, scale, settings, rng, proposers)
    return _answer_in_order(source, target, scale.inverse(), settings, rng, proposers).inverse()


def _answer_in_order(
    target: MapFeatures,
    source: MapFeatures,
    scale: ScaleRange,
    settings: MergeSettings,
    rng: np.random.Generator,
    proposers: int | None,
) -> PairAnswer:
    if settings.as_published:
        answer = settings.chosen_published.published(target.descriptions[0], source.descriptions[0], scale, rng)
        none = PairAnswer(None, None, Verdict.refuse(Reason.NO_PUBLISHED_ANSWER))
        return none if _collapses(target.prepared, source.prepared, answer) else answer
    return merge_pair(target, source, scale, settings.chosen_proposers[:proposers], rng, settings)


def _collapses(target: PreparedMap, source: PreparedMap, answer: PairAnswer) -> bool:
    """Return True for a transform that lays one whole map into a cell of the other, as fits to wrong matches may."""
    found = answer.target_from_source
    return found is not None and not 1.0 / source.diagonal < found.scale < target.diagonal


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
        if found[0].overlap.score >= settings.pair.competing_score:
            found = _with_second_best(*maps, found, scale, settings)
        answer = _best_answer(*maps, found, scale, settings)
        if answer.evidence is not None and _is_certain(answer.evidence, settings):
            break
    if answer.evidence is None or not _is_certain_alone(answer.evidence, settings):
        return answer
    return _with_symmetry(target, source, answer, settings)


def merge_pair_near(
    target: MapFeatures,
    source: MapFeatures,
    guesses: Sequence[Similarity2],
    scale: ScaleRange,
    settings: MergeSettings = MergeSettings(),
    allows: Callable[[Similarity2], bool] = lambda _: True,
) -> PairAnswer:
    """Merge two maps near given transforms, cells to cells; no transform far away makes the answer ambiguous.

    Only answers count that a prior ``allows``.
    """
    maps = target.prepared, source.prepared
    if _has_little_structure(*maps, settings):
        return PairAnswer(None, None, Verdict.refuse(Reason.LITTLE_STRUCTURE))
    rough = refine_proposals(*maps, [Proposal(guess) for guess in guesses], scale, settings.alignment)
    finalists = [each for each in rough if allows(each.target_from_source)][: settings.alignment.hypotheses.finalists]
    careful = refine_with_care(*maps, finalists, scale, settings.alignment)
    found = [each for each in careful if allows(each.target_from_source)]
    if not found:
        return PairAnswer(None, None, Verdict.refuse(Reason.CONTRADICTS_PRIOR))
    return _best_answer(*maps, found, scale, settings)


def _has_little_structure(target: PreparedMap, source: PreparedMap, settings: MergeSettings) -> bool:
    return min(len(target.points), len(source.points)) < settings.pair.min_wall_points


def _is_certain(evidence: Evidence, settings: MergeSettings) -> bool:
    return evidence.score >= settings.pair.sure_score and margin(evidence) >= settings.acceptance.margin_cap


def _is_certain_alone(evidence: Evidence, settings: MergeSettings) -> bool:
    """Return True if the answer would be accepted without a second best."""
    return decide(dataclasses.replace(evidence, second_best_score=0.0), settings.acceptance).accepted


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
    """Bend the best hypotheses, verify the one that then fits best, and accept or refuse it."""
    alignment, limits = settings.alignment, settings.alignment.hypotheses
    bent = [bend_hypothesis(target, source, each, scale, alignment) for each in found[: limits.bent]]
    best = max(bent, key=lambda hypothesis: hypothesis.score(alignment.elastic))
    level = best.tightest_tolerance(alignment)
    others = [
        Alternative(other.target_from_source, other.scores(alignment.elastic)[level])
        for other in bent
        if are_distinct(target, source, best, other, alignment)
    ]
    others.sort(key=lambda other: -other.score)
    answer = best.target_from_source
    uncertain = uncertainty(target, source, answer, scale, settings.uncertainty, alignment.overlap)
    second_best = others[0].score if others else 0.0
    evidence = _evidence(target, source, best, level, second_best, uncertain.precision_probability, alignment)
    verdict = decide(evidence, settings.acceptance)
    return PairAnswer(answer, evidence, verdict, uncertain, tuple(others[: settings.pair.alternatives]))


def _with_symmetry(target: MapFeatures, source: MapFeatures, answer: PairAnswer, settings: MergeSettings) -> PairAnswer:
    """Share the confidence of an answer with the placement that a symmetry of the place makes alike.

    An answer that a second best refuses is left as it is if that is another placement: the symmetry is not the reason.
    """
    found, evidence, alignment = answer.target_from_source, answer.evidence, settings.alignment
    if found is None or evidence is None:
        return answer
    maps, half_turns = (target.prepared, source.prepared), HalfTurns(settings.pair.symmetry, alignment)
    turns = [*target.describe(half_turns), *(found @ turn @ found.inverse() for turn in source.describe(half_turns))]
    level = _level(*maps, found.scale, evidence.tolerance_cells, alignment.overlap)
    place = other_placement(maps, turns, found, level, settings.pair.symmetry, alignment)
    near, elsewhere = _split_by(place, answer.alternatives, maps, alignment)
    if not answer.verdict.accepted and near[:1] != answer.alternatives[:1]:
        return answer
    evidence = dataclasses.replace(evidence, alike_placements=1 if place is None else 2)
    answer = dataclasses.replace(answer, evidence=evidence, verdict=decide(evidence, settings.acceptance))
    if place is not None and not near:
        fixed = ScaleRange(found.scale, found.scale)
        (refined,) = refine_proposals(*maps, [Proposal(place)], fixed, alignment)
        other = bend_hypothesis(*maps, refined, fixed, alignment)
        near = (Alternative(other.target_from_source, other.scores(alignment.elastic)[level]),)
    return dataclasses.replace(answer, alternatives=(*near, *elsewhere)[: settings.pair.alternatives])


def _level(
    target: PreparedMap, source: PreparedMap, scale: float, tolerance: float, settings: WallOverlapSettings
) -> int:
    """Return the index of the tightest tolerance that is at least that of an answer, in cells of the coarser map."""
    levels = range(len(settings.tolerance_shares))
    cells = [tolerance_cells(target, source, scale, settings, level) / max(1.0, scale) for level in levels]
    return max(level for level in levels if level == 0 or cells[level] >= tolerance * (1.0 - 1e-9))


def _split_by(
    place: Similarity2 | None,
    alternatives: Sequence[Alternative],
    maps: tuple[PreparedMap, PreparedMap],
    settings: AlignmentSettings,
) -> tuple[tuple[Alternative, ...], tuple[Alternative, ...]]:
    """Return the alternatives near a place, and the others."""
    if place is None:
        return (), tuple(alternatives)
    nearest = settings.hypotheses.distinct_share * smaller_diagonal(*maps, place.scale)
    shifts = rms_displacement(maps[1], [place, *(each.target_from_source for each in alternatives)])[0, 1:]
    near = [bool(shift <= nearest) for shift in shifts]
    return tuple(compress(alternatives, near)), tuple(compress(alternatives, [not each for each in near]))


def _evidence(
    target: PreparedMap,
    source: PreparedMap,
    best: BentHypothesis,
    level: int,
    second_best_score: float,
    precision_probability: float,
    settings: AlignmentSettings,
) -> Evidence:
    cells = compare_cells(target.grid, source.grid, best.target_from_source)
    contradiction = measure_contradiction(target, source, best.target_from_source, best.bend, settings)
    walls = best.rigid[level]
    return Evidence(
        acceptance_index=cells.acceptance_index,
        wall_inlier_ratio=walls.inlier_ratio,
        free_space_violation=walls.violation_ratio,
        deep_free_space_violation=best.rigid[0].violation_ratio,
        common_known_cells=cells.known,
        overlap=cells.overlap,
        inlier_length_cells=walls.inlier_length,
        tolerance_cells=walls.tolerance,
        normal_isotropy=walls.normal_isotropy,
        score=best.scores(settings.elastic)[level],
        second_best_score=second_best_score,
        precision_probability=precision_probability,
        matches=best.proposal.matches,
        inliers=best.proposal.inliers,
        votes=best.proposal.votes,
        local_violation=contradiction.violation_ratio,
        conflict_ratio=contradiction.conflict_ratio,
        conflict_cells=contradiction.conflict_cells,
        strain=best.bend.strain,
    )
