"""A method of the literature with its own answer and its own rule of acceptance, beside the common judge."""

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
    """The second face of a method that was published with an answer and a rule of its own.

    Its confidence is its own score, brought to 0 to 1: it orders answers and is no probability.
    """

    def describe(self, chart: PreparedMap) -> Description:
        """What the method needs to know of one map."""
        ...

    def published(
        self, target: Description, source: Description, scale: ScaleRange, rng: np.random.Generator
    ) -> PairAnswer:
        """The one answer that the method gives by itself. A rigid method works at the middle of the range."""
        ...


def judged(transform: Similarity2, name: str, score: float, threshold: float) -> PairAnswer:
    """An answer that is accepted where the method's score, not negative, reaches its threshold.

    The confidence s / (s + threshold) is 1/2 there; the reason of a refusal names the score.
    """
    accepted = score >= threshold
    text = f"{name} is {score:.3g}, {threshold:g} is needed"
    refusal = None if accepted else Refusal(Reason.PUBLISHED_RULE, text)
    return PairAnswer(transform, None, Verdict(accepted, score / (score + threshold), refusal))


def nothing_found() -> PairAnswer:
    """The answer of a method that found none."""
    return PairAnswer(None, None, Verdict.refuse(Reason.NO_PUBLISHED_ANSWER))
