"""Verdicts on pairs of a team: the one place that accepts or refuses an answer on other evidence than its own."""

from __future__ import annotations

import dataclasses

from merge.pair.task import PairTask
from merge.records.prior import Expected
from merge.records.result import DecidedBy, PairResult
from merge.records.verdict import Reason, Refusal


def needs_prior_search(answer: PairResult, expected: Expected) -> bool:
    """Check if a pair has to be matched again near its prior: it was refused, or it contradicts the prior."""
    found = answer.target_from_source
    return not answer.accepted or found is None or not expected.allows(found)


def with_prior(answer: PairResult, near: PairResult, expected: Expected) -> PairResult:
    """Accept the answer ``near`` the prior if it holds; else refuse an accepted answer, which contradicts the prior."""
    if near.accepted and near.target_from_source is not None and expected.allows(near.target_from_source):
        return _recovered(answer, near, "prior")
    return _refused(answer, Reason.CONTRADICTS_PRIOR, "prior") if answer.accepted else answer


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
    answer: PairResult, guided: PairResult, agrees: bool, confidence: float
) -> PairResult | None:
    """Accept a refused pair at the transform of the fused clusters, if its guided answer ``agrees``; else None.

    ``confidence`` is that of the match of the fused clusters, or of the weakest link inside them if that is less.
    """
    if guided.target_from_source is None or not agrees:
        return None
    accepted = dataclasses.replace(guided, accepted=True, refusal=None, confidence=confidence)
    return _recovered(answer, accepted, "team")


def verdict_by_itself(answer: PairResult) -> PairResult | None:
    """Restore the verdict of a pair before team and priors were used; None if it was not matched."""
    if answer.decided_by == "pair":
        return answer
    overruled = (Reason.CONTRADICTS_TEAM, Reason.CONTRADICTS_PRIOR)
    if answer.reason in overruled:
        return dataclasses.replace(answer, accepted=True, refusal=None, decided_by="pair")
    if answer.pair_refusal is not None:
        return dataclasses.replace(
            answer, accepted=False, refusal=answer.pair_refusal, pair_refusal=None, decided_by="pair", confidence=0.0
        )
    return None


def _refused(answer: PairResult, reason: Reason, by: DecidedBy) -> PairResult:
    return dataclasses.replace(answer, accepted=False, refusal=Refusal(reason), decided_by=by)


def _recovered(before: PairResult | None, now: PairResult, by: DecidedBy) -> PairResult:
    """Take an answer in place of a refusal, and keep the reason of that."""
    refusal = None if before is None else before.pair_refusal or before.refusal
    return dataclasses.replace(now, decided_by=by, pair_refusal=refusal)


def _not_tried(task: PairTask, reason: Reason) -> PairResult:
    return PairResult(*task.names, False, 0.0, Refusal(reason), None, None, task.units[0], None, decided_by="team")
