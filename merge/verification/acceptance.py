"""Whether to believe an answer."""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.special import expit

from merge.records.result import Evidence

BARE = "too little structure"
ONE_WAY = "too little structure: the walls in common all run one way, and the answer may slide along them"
OVERLAP = "too little overlap"
CONTRADICTION = "walls contradict free space"
RIVAL = "two answers equally good"
INEXACT = "the place is found, but too little structure in common to tell it exactly"


MIN_CONFIDENCE = 0.6

MISSING = 2.0
"""Log-odds against an answer that lacks what must be there."""


@dataclass(frozen=True)
class AcceptanceSettings:
    """The constants of ``decide``; lengths in cells of the coarser map.

    - ``lead``, ``contradiction``, ``threshold``: the log-odds of the right place are ``lead`` times what the best rival
      agrees less than the answer, less ``contradiction`` times the share of walls deep in free space times the overlap,
      less ``threshold``; a lead above ``enough_lead`` says no more, or a poor answer would pass for want of any other,
      and neither does a contradiction above ``enough_contradiction``, or no bent map would pass. Fitted to generated
      pairs by ``mapquilt calibrate``, the threshold raised by 0.4 from there: of the pairs of a team more do not match
      than the third that the fit takes for granted. (The agreement itself was fitted too, and weighs nothing beside
      the lead.);
    - ``min_matched_walls_cells``, ``min_spread``: walls on walls must be long enough, and run more than one way;
    - ``min_overlap``: the maps must share so much of the area that the smaller one knows;
    - ``min_agreement``: what agrees less is nothing, for want of rivals or not;
    - ``min_margin``: the best rival must agree less by this share, however good the rest;
    - ``min_confidence``: what is less sure is refused.

    Raises ``ValueError`` naming a constant that is not finite, or negative (but for the threshold), or a confidence
    above 1.
    """

    lead: float = 24.75
    contradiction: float = 134.4
    threshold: float = -0.5
    enough_lead: float = 0.25
    enough_contradiction: float = 0.03
    min_matched_walls_cells: float = 50.0
    min_spread: float = 0.08
    min_overlap: float = 0.1
    min_agreement: float = 0.4
    min_margin: float = 0.1
    min_confidence: float = MIN_CONFIDENCE

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if name not in ("min_confidence", "threshold") and not 0.0 <= value < math.inf:
                raise ValueError(f"DecisionSettings: {name} is {value}, must be finite and not negative")
        if not math.isfinite(self.threshold):
            raise ValueError(f"DecisionSettings: threshold is {self.threshold}, must be finite")
        if not 0.0 <= self.min_confidence <= 1.0:
            raise ValueError(f"DecisionSettings: min_confidence is {self.min_confidence}, must lie between 0 and 1")


@dataclass(frozen=True)
class Decision:
    """The verdict; ``reason`` is None where it is accepted."""

    accepted: bool
    confidence: float
    reason: str | None


def decide(evidence: Evidence, settings: AcceptanceSettings = AcceptanceSettings()) -> Decision:
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
    confidence = place * evidence.exactness
    if place >= settings.min_confidence:
        reason = INEXACT
    accepted = confidence >= settings.min_confidence
    return Decision(accepted, confidence, None if accepted else reason)


def lead_of(evidence: Evidence) -> float:
    """By how much the answer agrees better than its best rival; not negative."""
    return max(0.0, evidence.agreement - evidence.rival_agreement)


def features(evidence: Evidence, settings: AcceptanceSettings) -> tuple[float, float]:
    """What ``lead`` and, with a minus, ``contradiction`` weigh."""
    contradiction = (evidence.walls_deep_in_free or 0.0) * evidence.overlap
    return min(lead_of(evidence), settings.enough_lead), min(contradiction, settings.enough_contradiction)


def _log_odds(evidence: Evidence, settings: AcceptanceSettings) -> float:
    lead, contradiction = features(evidence, settings)
    return settings.lead * lead - settings.contradiction * contradiction - settings.threshold


def _needed(evidence: Evidence, settings: AcceptanceSettings) -> tuple[tuple[str, float, float], ...]:
    return (
        (BARE, evidence.matched_walls_cells, settings.min_matched_walls_cells),
        (ONE_WAY, evidence.spread, settings.min_spread),
        (OVERLAP, evidence.overlap, settings.min_overlap),
        (_lacking(evidence, settings), evidence.agreement, settings.min_agreement),
        (RIVAL, lead_of(evidence), settings.min_margin * evidence.agreement),
    )


def _lacking(evidence: Evidence, settings: AcceptanceSettings) -> str:
    without_rival = min(evidence.agreement, settings.enough_lead)
    if lead_of(evidence) < without_rival and evidence.agreement >= settings.min_agreement:
        return RIVAL
    share = evidence.walls_on_walls or 0.0
    by_contradiction, by_little_overlap = 1.0 - share**2, share**2 - evidence.agreement
    return CONTRADICTION if by_contradiction > by_little_overlap else OVERLAP
