"""Whether to believe an answer."""

from __future__ import annotations

import math
from dataclasses import dataclass

from merge.result import Evidence


@dataclass(frozen=True)
class Criterion:
    """One condition: ``value`` must reach ``needed``; ``unit`` is how much more or less makes a clear difference."""

    reason: str
    value: float
    needed: float
    unit: float

    @property
    def slack(self) -> float:
        """By how many units the condition is met; negative where it is not."""
        return (self.value - self.needed) / self.unit


@dataclass(frozen=True)
class DecisionSettings:
    """The bounds of :func:`decide`; lengths in cells of the coarser map.

    - ``min_matched_walls_cells``, ``min_spread``: walls on walls must be long enough, and run more than one way;
    - ``min_overlap``, ``min_agreement``: the maps must share enough area, and enough of their walls;
    - ``max_walls_in_free``: on the maps of Chen 2021 at most 0.09 where right, mostly 0.2 or more where wrong;
    - ``min_walls_on_walls``: there 0.87 or more where right, 0.73 or less where wrong; noise lowers it;
    - ``min_margin``: the best distinct rival must lie this share below the best. One room further along a corridor of
      equal rooms loses 0.05 to 0.25; elsewhere the best wrong answer mostly loses 0.4 and more.

    Raises ``ValueError`` naming a bound that is not within 0 to 1, or a length that is not positive.
    """

    min_walls_on_walls: float = 0.75
    max_walls_in_free: float = 0.15
    min_overlap: float = 0.1
    min_matched_walls_cells: float = 80.0
    min_spread: float = 0.08
    min_agreement: float = 0.35
    min_margin: float = 0.3

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if name == "min_matched_walls_cells":
                if not 0.0 < value < math.inf:
                    raise ValueError(f"DecisionSettings: {name} is {value}, must be positive and finite")
            elif not 0.0 <= value <= 1.0:
                raise ValueError(f"DecisionSettings: {name} is {value}, must lie in 0 to 1")


@dataclass(frozen=True)
class Decision:
    """The verdict; ``confidence`` is at least 1/2 exactly where it is accepted, and ``reason`` is None there."""

    accepted: bool
    confidence: float
    reason: str | None


def decide(evidence: Evidence, settings: DecisionSettings = DecisionSettings()) -> Decision:
    """Accept where every criterion is met; otherwise refuse for the one that is missed by most.

    The confidence is the logistic function of twice the least slack: it rises with every piece of evidence, but is not
    calibrated.
    """
    weakest = min(_criteria(evidence, settings), key=lambda criterion: criterion.slack)
    confidence = 1.0 / (1.0 + math.exp(-2.0 * max(-20.0, min(20.0, weakest.slack))))
    accepted = weakest.slack >= 0.0
    return Decision(accepted, confidence, None if accepted else weakest.reason)


def _criteria(evidence: Evidence, settings: DecisionSettings) -> tuple[Criterion, ...]:
    margin = 1.0 - evidence.rival_agreement / evidence.agreement if evidence.agreement > 0.0 else 0.0
    on_walls = evidence.walls_on_walls or 0.0
    in_free = 1.0 if evidence.walls_in_free is None else evidence.walls_in_free
    length = evidence.matched_walls_cells
    return (
        Criterion("too little structure", math.log(max(length, 1.0) / settings.min_matched_walls_cells), 0.0, 0.5),
        Criterion("too little structure", evidence.spread, settings.min_spread, 0.08),
        Criterion("too little overlap", evidence.overlap, settings.min_overlap, 0.1),
        Criterion("too little overlap", evidence.agreement, settings.min_agreement, 0.1),
        Criterion("walls contradict free space", -in_free, -settings.max_walls_in_free, 0.05),
        Criterion("walls do not lie on walls", on_walls, settings.min_walls_on_walls, 0.08),
        Criterion("two answers equally good", margin, settings.min_margin, 0.1),
    )
