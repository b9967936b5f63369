"""Whether to believe an answer."""

from __future__ import annotations

import math
from dataclasses import dataclass

from merge.result import Evidence

BARE = "too little structure"
ONE_WAY = "too little structure: the walls in common all run one way, and the answer may slide along them"
OVERLAP = "too little overlap"
CONTRADICTION = "walls contradict free space"
RIVAL = "two answers equally good"


@dataclass(frozen=True)
class DecisionSettings:
    """The constants of :func:`decide`, set on generated pairs; lengths in cells of the coarser map.

    - ``agreement``, ``margin``, ``threshold``: the log-odds of being right are ``agreement`` times the agreement, plus
      ``margin`` times the share by which the best rival lies below it, less ``threshold``; a margin above
      ``enough_margin`` says no more, or a poor answer would pass for want of any other;
    - ``min_matched_walls_cells``, ``min_spread``: walls on walls must be long enough, and run more than one way;
    - ``min_overlap``: the maps must share so much of the area that the smaller one knows;
    - ``min_margin``: a rival nearer than that is never overlooked, however good the rest.

    Raises ``ValueError`` naming a constant that is negative or not finite.
    """

    agreement: float = 10.0
    margin: float = 15.0
    threshold: float = 9.5
    enough_margin: float = 0.35
    min_matched_walls_cells: float = 80.0
    min_spread: float = 0.08
    min_overlap: float = 0.1
    min_margin: float = 0.1

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0.0 <= value < math.inf:
                raise ValueError(f"DecisionSettings: {name} is {value}, must be finite and not negative")


@dataclass(frozen=True)
class Decision:
    """The verdict; ``confidence`` is at least 1/2 exactly where it is accepted, and ``reason`` is None there."""

    accepted: bool
    confidence: float
    reason: str | None


def decide(evidence: Evidence, settings: DecisionSettings = DecisionSettings()) -> Decision:
    """Accept where the log-odds of being right are not negative and nothing that must be there is missing.

    The confidence rises with every piece of evidence, but is not calibrated on anything but office worlds. A refusal
    names what is missing most; a rival is named where the answer would be believed without it.
    """
    odds, reason = _log_odds(evidence, settings, _margin(evidence)), _lacking(evidence, settings)
    for missing, value, needed in _needed(evidence, settings):
        if value < needed:
            odds, reason = min(odds, value / needed - 1.01), missing
            break
    confidence = 1.0 / (1.0 + math.exp(-max(-40.0, min(40.0, odds))))
    accepted = odds >= 0.0
    return Decision(accepted, confidence, None if accepted else reason)


def _log_odds(evidence: Evidence, settings: DecisionSettings, margin: float) -> float:
    counted = min(margin, settings.enough_margin)
    return settings.agreement * evidence.agreement + settings.margin * counted - settings.threshold


def _needed(evidence: Evidence, settings: DecisionSettings) -> tuple[tuple[str, float, float], ...]:
    return (
        (BARE, evidence.matched_walls_cells, settings.min_matched_walls_cells),
        (ONE_WAY, evidence.spread, settings.min_spread),
        (OVERLAP, evidence.overlap, settings.min_overlap),
        (_lacking(evidence, settings), _margin(evidence), settings.min_margin),
    )


def _lacking(evidence: Evidence, settings: DecisionSettings) -> str:
    if _log_odds(evidence, settings, settings.enough_margin) >= 0.0:
        return RIVAL
    share = evidence.walls_on_walls or 0.0
    by_contradiction, by_little_overlap = 1.0 - share**2, share**2 - evidence.agreement
    return CONTRADICTION if by_contradiction > by_little_overlap else OVERLAP


def _margin(evidence: Evidence) -> float:
    return 1.0 - min(1.0, evidence.rival_agreement / evidence.agreement) if evidence.agreement > 0.0 else 0.0
