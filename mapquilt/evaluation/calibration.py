"""Whether a confidence means what it says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapquilt.benchmark.trial import Trial
from mapquilt.evaluation.statistics import Share

BINS = 10


@dataclass(frozen=True)
class Bin:
    """A tenth of the answers, by confidence: their mean confidence, and how many were right."""

    confidence: float
    right: Share


@dataclass(frozen=True)
class Calibration:
    """Of one method, over all answers to pairs that are not bent; an answer to a negative is never right.

    ``brier``: Brier 1950, ``base_brier`` that of always saying the base rate; ``ece``: expected calibration error over
    bins of equal mass (Naeini et al. 2015); ``auc``: chance that a right answer bears the higher confidence, ties
    counting half, None where all answers are right or none is; ``nees``: mean normalised squared error of the right
    answers (``normalised_error``), None where none came with a covariance.
    """

    method: str
    pairs: int
    brier: float
    base_brier: float
    ece: float
    auc: float | None
    nees: float | None
    bins: tuple[Bin, ...]


def calibration(trials: Sequence[Trial], method: int) -> Calibration | None:
    """Of the method at this place in the trials' order; None where no pair is left to tell."""
    answers = [trial.answers[method] for trial in trials if not trial.bent]
    if not answers:
        return None
    confidence = np.array([answer.confidence for answer in answers])
    right = np.array([answer.right for answer in answers])
    bins = equal_mass_bins(confidence, right)
    gaps = [one.right.of * abs(one.confidence - one.right.value) for one in bins]
    return Calibration(
        answers[0].method,
        len(answers),
        float(((confidence - right) ** 2).mean()),
        float(right.mean() * (1.0 - right.mean())),
        sum(gaps) / len(answers),
        auc(confidence, right),
        _mean([answer.normalised_error for answer in answers if answer.right]),
        bins,
    )


def _mean(values: Sequence[float | None]) -> float | None:
    told = [value for value in values if value is not None]
    return float(np.mean(told)) if told else None


def equal_mass_bins(confidence: NDArray[np.float64], right: NDArray[np.bool_]) -> tuple[Bin, ...]:
    """Answers sorted by confidence (N,), cut in ten parts of equal number, fewer where there are not ten."""
    order = np.argsort(confidence, kind="stable")
    parts = [part for part in np.array_split(order, BINS) if len(part)]
    return tuple(Bin(float(confidence[part].mean()), Share.counted(right[part].tolist())) for part in parts)


def auc(confidence: NDArray[np.float64], right: NDArray[np.bool_]) -> float | None:
    """Area under the ROC curve, by ranks (Mann and Whitney 1947)."""
    from scipy.stats import rankdata

    positives = int(right.sum())
    negatives = len(right) - positives
    if not positives or not negatives:
        return None
    ranks = rankdata(confidence)
    return float((ranks[right].sum() - positives * (positives + 1) / 2.0) / (positives * negatives))
