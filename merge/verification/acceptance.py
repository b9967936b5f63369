"""Whether to believe an answer."""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.special import expit

from merge.records.result import Evidence
from merge.records.verdict import Reason, Refusal, Verdict

MIN_CONFIDENCE = 0.6

MISSING = 2.0
"""Log-odds against an answer that lacks what must be there."""


@dataclass(frozen=True)
class AcceptanceSettings:
    """Constants of ``decide``; lengths in cells of the coarser map.

    The log-odds that the answer is right are ``margin_weight`` times the margin, less ``contradiction_weight`` times
    the contradiction, less ``threshold``. The margin is the score less the second best score. The contradiction is the
    share of walls deep in free space times the overlap. All three were fitted to generated pairs by ``mapquilt
    calibrate``; then the threshold was raised by 0.4, because more pairs of a team do not match than the third that
    the fit assumes. (The fit gave the score itself no weight beside the margin.)

    - ``margin_cap``: a larger margin counts as this, or a poor answer would pass for want of any other;
    - ``contradiction_cap``: a larger contradiction counts as this, or no distorted map would pass;
    - ``min_inlier_length_cells``, ``min_normal_isotropy``: the matched walls must be so long, and run in more than one
      direction;
    - ``min_overlap``: the maps must share this fraction of the area that the smaller one knows;
    - ``min_score``: an answer that scores less is refused, whether there is a second best or not;
    - ``min_relative_margin``: the margin must be this fraction of the score, however good the rest;
    - ``min_confidence``: an answer of less confidence is refused.

    Raises ``ValueError`` naming a constant that is not finite, or negative (but for the threshold), or a confidence
    above 1.
    """

    margin_weight: float = 24.75
    contradiction_weight: float = 134.4
    threshold: float = -0.5
    margin_cap: float = 0.25
    contradiction_cap: float = 0.03
    min_inlier_length_cells: float = 50.0
    min_normal_isotropy: float = 0.08
    min_overlap: float = 0.1
    min_score: float = 0.4
    min_relative_margin: float = 0.1
    min_confidence: float = MIN_CONFIDENCE

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if name not in ("min_confidence", "threshold") and not 0.0 <= value < math.inf:
                raise ValueError(f"AcceptanceSettings: {name} is {value}, must be finite and not negative")
        if not math.isfinite(self.threshold):
            raise ValueError(f"AcceptanceSettings: threshold is {self.threshold}, must be finite")
        if not 0.0 <= self.min_confidence <= 1.0:
            raise ValueError(f"AcceptanceSettings: min_confidence is {self.min_confidence}, must lie between 0 and 1")


def decide(evidence: Evidence, settings: AcceptanceSettings = AcceptanceSettings()) -> Verdict:
    """Accept where the answer is sure enough and nothing that must be there is missing.

    The confidence is the chance that the place is the right one, times that of its being told exactly enough; it rises
    with every piece of evidence. A refusal names what is missing most: a rival, where one takes from what the answer
    would be worth by itself.
    """
    odds, reason = _log_odds(evidence, settings), _lacking(evidence, settings)
    for missing, value, needed in _needed(evidence, settings):
        if value < needed:
            odds, reason = min(odds, value / needed - 1.0 - MISSING), missing
            break
    place = float(expit(odds))
    confidence = place * evidence.precision_probability
    if place >= settings.min_confidence:
        reason = Reason.IMPRECISE
    accepted = confidence >= settings.min_confidence
    return Verdict(accepted, confidence, None if accepted else Refusal(reason))


def margin(evidence: Evidence) -> float:
    """By how much the answer agrees better than its best rival; not negative."""
    return max(0.0, evidence.score - evidence.second_best_score)


def features(evidence: Evidence, settings: AcceptanceSettings) -> tuple[float, float]:
    """Return the margin and the contradiction that the weights multiply, each cut at its cap."""
    contradiction = (evidence.deep_free_space_violation or 0.0) * evidence.overlap
    return min(margin(evidence), settings.margin_cap), min(contradiction, settings.contradiction_cap)


def _log_odds(evidence: Evidence, settings: AcceptanceSettings) -> float:
    margin_, contradiction = features(evidence, settings)
    return settings.margin_weight * margin_ - settings.contradiction_weight * contradiction - settings.threshold


def _needed(evidence: Evidence, settings: AcceptanceSettings) -> tuple[tuple[Reason, float, float], ...]:
    return (
        (Reason.LITTLE_STRUCTURE, evidence.inlier_length_cells, settings.min_inlier_length_cells),
        (Reason.PARALLEL_WALLS, evidence.normal_isotropy, settings.min_normal_isotropy),
        (Reason.LITTLE_OVERLAP, evidence.overlap, settings.min_overlap),
        (_lacking(evidence, settings), evidence.score, settings.min_score),
        (Reason.AMBIGUOUS, margin(evidence), settings.min_relative_margin * evidence.score),
    )


def _lacking(evidence: Evidence, settings: AcceptanceSettings) -> Reason:
    without_rival = min(evidence.score, settings.margin_cap)
    if margin(evidence) < without_rival and evidence.score >= settings.min_score:
        return Reason.AMBIGUOUS
    share = evidence.wall_inlier_ratio or 0.0
    by_contradiction, by_little_overlap = 1.0 - share**2, share**2 - evidence.score
    return Reason.FREE_SPACE_VIOLATION if by_contradiction > by_little_overlap else Reason.LITTLE_OVERLAP
