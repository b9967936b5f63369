"""The constants of the merger's decision, fitted on pairs whose transform is known."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from mapquilt.benchmark.strata import OVERLAPS, overlap_class
from mapquilt.benchmark.trial import Answer, Trial
from merge.records.result import Evidence
from merge.verification.acceptance import AcceptanceSettings, decide, features

RIDGE = 1e-8
FITTED = ("margin_weight", "contradiction_weight", "threshold")
SIGNS = np.array([1.0, -1.0])
"""Contradiction takes from the log-odds."""

LEAST_OVERLAP = OVERLAPS[1][0]


def fit_acceptance(trials: Sequence[Trial], start: AcceptanceSettings = AcceptanceSettings()) -> AcceptanceSettings:  # noqa: B008
    """Fit ``margin_weight``, ``contradiction_weight`` and ``threshold`` of ``start`` by logistic regression, the first
    two not negative.

    ``trials`` hold one method's answers. Pairs of much overlap, of 15 to 30 %, and all that should be refused weigh a
    third each, those counted that other rules refuse. What is fitted is the chance that the place is the right one
    (``FOUND``), so that bent pairs teach as well. Left out are answers that other rules refuse
    anyway, and pairs that are not identifiable: where two places look alike the evidence for the wrong one is as good
    as any, and would only teach to mistrust it.

    Raises ``ValueError`` where right and wrong answers are not both there.
    """
    told = [trial for trial in trials if trial.negative or trial.pair.identifiable]
    judged = [
        (trial, evidence, weight)
        for trial, weight in zip(told, _weights([_group(trial) for trial in told]), strict=True)
        for evidence in _open(trial, start)
    ]
    right = np.array([trial.answers[0].found for trial, _, _ in judged])
    if right.all() or not right.any():
        raise ValueError(f"calibrate: needs right and wrong answers, of {len(right)} are {int(right.sum())} right")
    weights = np.array([weight for _, _, weight in judged])
    weights /= weights.sum()
    seen = np.array([features(evidence, start) for _, evidence, _ in judged]) * SIGNS
    fitted = dict(zip(FITTED, _logistic(seen, right, weights), strict=True))
    return dataclasses.replace(start, **fitted)


def judged_again(trials: Sequence[Trial], settings: AcceptanceSettings) -> list[Trial]:
    """The trials as they would have been decided by other constants."""
    return [
        dataclasses.replace(trial, answers=tuple(_decided(answer, settings) for answer in trial.answers))
        for trial in trials
    ]


def _decided(answer: Answer, settings: AcceptanceSettings) -> Answer:
    if answer.evidence is None:
        return answer
    verdict = decide(answer.evidence, settings)
    text = None if verdict.refusal is None else str(verdict.refusal)
    return dataclasses.replace(answer, accepted=verdict.accepted, confidence=verdict.confidence, reason=text)


def _open(trial: Trial, settings: AcceptanceSettings) -> list[Evidence]:
    """The evidence where the fitted rule decides, and not one of the others; nothing elsewhere."""
    evidence = trial.answers[0].evidence
    if evidence is None:
        return []
    even = dataclasses.replace(settings, **dict.fromkeys(FITTED, 0.0), min_confidence=0.5)
    return [evidence] if decide(dataclasses.replace(evidence, precision_probability=1.0), even).accepted else []


def _group(trial: Trial) -> str:
    overlap = trial.pair.overlap
    wanted = not trial.negative and (overlap is None or overlap >= LEAST_OVERLAP)
    return overlap_class(trial) if wanted else "to be refused"


def _weights(groups: Sequence[str]) -> NDArray[np.float64]:
    names, index, counts = np.unique(groups, return_inverse=True, return_counts=True)
    return np.asarray(1.0 / (len(names) * counts[index]), np.float64)


def _logistic(
    features: NDArray[np.float64], right: NDArray[np.bool_], weights: NDArray[np.float64]
) -> tuple[float, ...]:
    """The weights of the features, not negative, and the threshold, of either sign."""
    from scipy.optimize import minimize

    inputs = np.column_stack((features, -np.ones(len(features))))

    def loss(constants: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        odds = inputs @ constants
        chance = expit(odds)
        value = float((weights * (np.logaddexp(0.0, odds) - right * odds)).sum() + RIDGE * (constants**2).sum())
        return value, inputs.T @ (weights * (chance - right)) + 2.0 * RIDGE * constants

    found = minimize(
        loss,
        np.zeros(inputs.shape[1]),
        jac=True,
        method="L-BFGS-B",
        bounds=[*[(0.0, None)] * features.shape[1], (None, None)],
        options={"ftol": 1e-14, "gtol": 1e-9},
    )
    return tuple(found.x.tolist())
