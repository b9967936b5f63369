"""Interface of methods that answer as published, with an acceptance rule of their own."""

from __future__ import annotations

from typing import Protocol, TypeVar

import numpy as np

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.preparation.prepared_map import PreparedMap
from merge.records.pair_answer import PairAnswer
from merge.records.verdict import Reason, Refusal, Verdict

Description = TypeVar("Description")


class Published(Protocol[Description]):
    """A method as it was published, with its own answer and its own acceptance rule.

    The confidence is its own score, mapped to 0 to 1: it ranks answers and is no probability.
    """

    def describe(self, chart: PreparedMap) -> Description:
        """Compute all that the method needs of one map."""
        ...

    def published(
        self, target: Description, source: Description, scale: ScaleRange, rng: np.random.Generator
    ) -> PairAnswer:
        """Return the answer of the method by itself. A rigid method uses the middle of the scale range."""
        ...


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
