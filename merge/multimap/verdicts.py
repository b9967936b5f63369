"""Verdicts on pairs of a team: the one place that accepts or refuses an answer on other evidence than its own."""

from __future__ import annotations

import dataclasses
import math

from merge.pair.task import PairTask
from merge.records.prior import Expected
from merge.records.result import DecidedBy, PairResult
from merge.records.verdict import Reason, Refusal

NOTHING_THERE = (Reason.LITTLE_STRUCTURE, Reason.LITTLE_OVERLAP, Reason.CONTRADICTS_PRIOR)
"""Refusals of a search near a prior that say that the maps do not lie there."""


def needs_prior_search(answer: PairResult, expected: Expected) -> bool:
    """Check if a pair has to be matched again near its prior: it was refused, or it contradicts the prior."""
    found = answer.target_from_source
    return not answer.accepted or found is None or not expected.allows(found)


def with_prior(answer: PairResult, near: PairResult, expected: Expected) -> PairResult:
    """Accept the answer ``near`` the prior if it holds; else refuse the pair.

    A refused pair keeps its answer if the prior allows that. Otherwise it has the answer near the prior, or none: none
    too if the maps do not fit there, but do elsewhere.
    """
    found, held = answer.target_from_source, near.target_from_source
    if near.accepted and held is not None and expected.allows(held):
        return _recovered(answer, near, "prior")
    if found is not None and expected.allows(found):
        return answer
    elsewhere = answer.accepted and near.reason in NOTHING_THERE
    if held is not None and expected.allows(held) and not elsewhere:
        return dataclasses.replace(near, decided_by="prior")
    nowhere = dataclasses.replace(
        near, target_from_source=None, target_from_source_pixels=None, evidence=None, covariance=None, confidence=0.0
    )
    return _refused(nowhere, Reason.CONTRADICTS_PRIOR, "prior", _distance(answer, expected))


def _distance(answer: PairResult, expected: Expected) -> str:
    """Say how far an accepted answer is from its expected pose; nothing of others."""
    if answer.target_from_source is None or not answer.accepted:
        return ""
    shift, turn = expected.distance(answer.target_from_source)
    return f": the maps fit {shift:.1f} m and {math.degrees(turn):.0f} degrees from there"


def within_prior(answer: PairResult, expected: Expected) -> PairResult:
    """Leave out the alternatives that contradict the prior."""
    kept = tuple(other for other in answer.alternatives if expected.allows(other.target_from_source))
    return dataclasses.replace(answer, alternatives=kept)


def with_guided_answer(
    answer: PairResult | None, guided: PairResult | None, agrees: bool, bridge: float
) -> PairResult | None:
    """Accept a guided answer that is accepted by itself and ``agrees`` with the poses of the cluster; else None.

    ``bridge`` is the confidence of the chain of pairs that put the two maps there. The answer is never surer than that:
    two storeys that look alike confirm one another in every pair.
    """
    if guided is None or not guided.accepted or not agrees:
        return None
    capped = dataclasses.replace(guided, confidence=min(guided.confidence, bridge))
    return _recovered(answer, capped, "team")


def outside_graph(answer: PairResult | None, task: PairTask, overlaps: bool) -> PairResult:
    """Refuse a pair of a cluster that no edge of it joins, unless it was refused already.

    ``overlaps`` is True if the cluster predicts that the two maps overlap.
    """
    if answer is None:
        return _not_tried(task, Reason.NOT_SELECTED if overlaps else Reason.NO_PREDICTED_OVERLAP)
    return _refused(answer, Reason.CONTRADICTS_TEAM, "team") if answer.accepted else answer


def across_clusters(answer: PairResult | None, task: PairTask) -> PairResult:
    """Refuse a pair of maps in different clusters, unless it was refused already."""
    return outside_graph(answer, task, overlaps=True)


def with_agreeing_refusals(
    answer: PairResult | None, guided: PairResult, agrees: bool, confidence: float
) -> PairResult | None:
    """Accept a refused pair where its two clusters join as a whole, if its guided answer ``agrees``; else None.

    ``confidence`` is that of the join, or of the weakest link inside the clusters if that is less.
    """
    if guided.target_from_source is None or not agrees:
        return None
    accepted = dataclasses.replace(guided, accepted=True, refusal=None, confidence=confidence)
    return _recovered(answer, accepted, "team")


def verdict_by_itself(answer: PairResult) -> PairResult | None:
    """Restore the verdict of a pair before team and priors were used; None if its answer was not kept."""
    if answer.decided_by == "pair":
        return answer
    if answer.reason is Reason.CONTRADICTS_TEAM:
        return dataclasses.replace(answer, accepted=True, refusal=None, decided_by="pair")
    if answer.pair_refusal is not None:
        return dataclasses.replace(
            answer, accepted=False, refusal=answer.pair_refusal, pair_refusal=None, decided_by="pair", confidence=0.0
        )
    return None


def _refused(answer: PairResult, reason: Reason, by: DecidedBy, detail: str = "") -> PairResult:
    return dataclasses.replace(answer, accepted=False, refusal=Refusal(reason, detail), decided_by=by)


def _recovered(before: PairResult | None, now: PairResult, by: DecidedBy) -> PairResult:
    """Take an answer in place of a refusal, and keep the reason of that."""
    refusal = None if before is None else before.pair_refusal or before.refusal
    return dataclasses.replace(now, decided_by=by, pair_refusal=refusal)


def _not_tried(task: PairTask, reason: Reason) -> PairResult:
    return PairResult(*task.names, False, 0.0, Refusal(reason), None, None, task.units[0], None, decided_by="team")
