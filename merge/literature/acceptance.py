"""Acceptance rules of published methods."""

from __future__ import annotations

from mapping.geometry.similarity2 import Similarity2
from merge.records.pair_answer import PairAnswer
from merge.records.verdict import Reason, Refusal, Verdict


def accept_by_score(transform: Similarity2, name: str, score: float, threshold: float) -> PairAnswer:
    """Accept an answer if the method's score, at least 0, reaches its threshold.

    The confidence s / (s + threshold) is 1/2 there. The text of a refusal names the score.
    """
    accepted = score >= threshold
    text = f"{name} is {score:.3g}, {threshold:g} is needed"
    refusal = None if accepted else Refusal(Reason.PUBLISHED_RULE, text)
    return PairAnswer(transform, None, Verdict(accepted, score / (score + threshold), refusal))


def no_answer() -> PairAnswer:
    """Refuse, because the method found no answer."""
    return PairAnswer(None, None, Verdict.refuse(Reason.NO_PUBLISHED_ANSWER))
