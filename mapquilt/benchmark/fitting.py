"""Fit of the acceptance constants on pairs whose transform is known."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from mapquilt.benchmark.strata import OVERLAPS, overlap_class
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from merge.records.evidence import Evidence
from merge.verification.acceptance import decide, features
from merge.verification.settings import AcceptanceSettings

RIDGE = 1e-8
FITTED = ("margin_weight", "contradiction_weight", "conflict_weight", "threshold")
SIGNS = np.array([1.0, -1.0, -1.0])
"""Contradiction and conflict lower the log-odds."""

LEAST_OVERLAP = OVERLAPS[1][0]


def fit_acceptance(
    pairs: Sequence[EvaluatedPair],
    start: AcceptanceSettings = AcceptanceSettings(),
) -> AcceptanceSettings:
    """Fit the three weights and ``threshold`` of ``start`` by logistic regression, the weights not negative.

    ``pairs`` are one method's answers. Three groups weigh a third each: overlap of at least 30 %, overlap of 15 to
    30 %, and all pairs that should be refused, those counted that other rules refuse. The model predicts that the
    answer lies at the right place (``RIGHT_PLACE``), so that distorted pairs are useful as well. Answers that other
    rules refuse anyway are left out, and pairs that are not identifiable: where two places look alike, the evidence for
    the wrong one is as good, and the fit would only learn to mistrust it.

    Raises ``ValueError`` if there are no right or no wrong answers.
    """
    unambiguous = [one for one in pairs if one.negative or one.identifiable]
    judged = [
        (one, evidence, weight)
        for one, weight in zip(unambiguous, _weights([_group(one) for one in unambiguous]), strict=True)
        for evidence in _open_evidence(one, start)
    ]
    right = np.array([one.right_place for one, _, _ in judged])
    if right.all() or not right.any():
        raise ValueError(
            f"calibrate: {int(right.sum())} of {len(right)} answers are right; the fit needs right and wrong ones"
        )
    weights = np.array([weight for _, _, weight in judged])
    weights /= weights.sum()
    seen = np.array([features(evidence, start) for _, evidence, _ in judged]) * SIGNS
    fitted = dict(zip(FITTED, _logistic(seen, right, weights), strict=True))
    return dataclasses.replace(start, **fitted)


def decide_again(pairs: Sequence[EvaluatedPair], settings: AcceptanceSettings) -> list[EvaluatedPair]:
    """Replace the decision of every pair that has evidence by that of other constants."""
    return [_decide(one, settings) for one in pairs]


def _decide(one: EvaluatedPair, settings: AcceptanceSettings) -> EvaluatedPair:
    if one.evidence is None:
        return one
    decision = decide(one.evidence, settings)
    reason = None if decision.refusal is None else str(decision.refusal)
    return dataclasses.replace(one, accepted=decision.accepted, confidence=decision.confidence, reason=reason)


def _open_evidence(one: EvaluatedPair, settings: AcceptanceSettings) -> list[Evidence]:
    """Return the evidence if the fitted rule decides; nothing if another rule refuses."""
    if one.evidence is None:
        return []
    even = dataclasses.replace(settings, **dict.fromkeys(FITTED, 0.0), min_confidence=0.5)
    return [one.evidence] if decide(dataclasses.replace(one.evidence, precision_probability=1.0), even).accepted else []


def _group(one: EvaluatedPair) -> str:
    overlap = one.truth.overlap
    wanted = not one.negative and (overlap is None or overlap >= LEAST_OVERLAP)
    return overlap_class(one) if wanted else "to be refused"


def _weights(groups: Sequence[str]) -> NDArray[np.float64]:
    names, index, counts = np.unique(groups, return_inverse=True, return_counts=True)
    return np.asarray(1.0 / (len(names) * counts[index]), np.float64)


def _logistic(
    features: NDArray[np.float64], right: NDArray[np.bool_], weights: NDArray[np.float64]
) -> tuple[float, ...]:
    """Fit the weights of the features, not negative, and the threshold, of either sign."""
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
