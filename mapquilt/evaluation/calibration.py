"""Calibration of a confidence against the share of right answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.statistics import Share

BINS = 10


@dataclass(frozen=True)
class Bin:
    """Answers of similar confidence: their mean confidence, and the share of right ones."""

    confidence: float
    right: Share


@dataclass(frozen=True)
class Calibration:
    """Calibration of one method over all pairs with a reliable truth; an answer to a negative pair is never right.

    ``brier``: Brier 1950, ``base_brier`` that of always claiming the base rate; ``ece``: expected calibration error
    over bins of equal mass (Naeini et al. 2015); ``auc``: probability that a right answer has the higher confidence,
    ties counting half, None if all answers are right or none is; ``nees``: mean normalised squared error of the
    right answers (``normalised_error``), None if none has a covariance.
    """

    method: str
    pairs: int
    brier: float
    base_brier: float
    ece: float
    auc: float | None
    nees: float | None
    bins: tuple[Bin, ...]


def calibration(pairs: Sequence[EvaluatedPair]) -> Calibration | None:
    """Measure the calibration of one method's answers; None if no pair has a reliable truth."""
    judged = [one for one in pairs if one.reliable and one.confidence is not None]
    if not judged:
        return None
    confidence = np.array([one.confidence for one in judged], np.float64)
    right = np.array([one.right for one in judged])
    bins = equal_mass_bins(confidence, right)
    gaps = [one.right.of * abs(one.confidence - one.right.value) for one in bins]
    squares = [one.normalised_error for one in judged if one.right and one.normalised_error is not None]
    return Calibration(
        method=judged[0].method,
        pairs=len(judged),
        brier=float(((confidence - right) ** 2).mean()),
        base_brier=float(right.mean() * (1.0 - right.mean())),
        ece=sum(gaps) / len(judged),
        auc=auc(confidence, right),
        nees=float(np.mean(squares)) if squares else None,
        bins=bins,
    )


def equal_mass_bins(confidence: NDArray[np.float64], right: NDArray[np.bool_]) -> tuple[Bin, ...]:
    """Sort answers by confidence (N,) and cut them into ten bins of equal number, fewer if there are not ten."""
    order = np.argsort(confidence, kind="stable")
    parts = [part for part in np.array_split(order, BINS) if len(part)]
    return tuple(Bin(float(confidence[part].mean()), Share.counted(right[part].tolist())) for part in parts)


def auc(confidence: NDArray[np.float64], right: NDArray[np.bool_]) -> float | None:
    """Compute the area under the ROC curve by ranks (Mann and Whitney 1947)."""
    from scipy.stats import rankdata

    positives = int(right.sum())
    negatives = len(right) - positives
    if not positives or not negatives:
        return None
    ranks = rankdata(confidence)
    return float((ranks[right].sum() - positives * (positives + 1) / 2.0) / (positives * negatives))
