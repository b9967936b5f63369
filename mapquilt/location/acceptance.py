"""Confidence that a map lies on a plan, by the merger and by the plan's walls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from scipy.special import expit

from mapping.validation import require_valid
from mapquilt.location.wall_agreement import WallAgreement
from merge.records.evidence import Evidence
from merge.records.result import PairResult
from merge.records.verdict import Reason
from merge.verification.acceptance import margin
from merge.verification.settings import AcceptanceSettings

DOUBTED = (None, Reason.FREE_SPACE_VIOLATION, Reason.AMBIGUOUS, Reason.LOW_CONFIDENCE)
"""Verdicts of the merger that the walls of a plan may overrule: furniture that no plan shows, and close rivals."""


@dataclass(frozen=True)
class PlanAcceptanceSettings:
    """Constants of ``decide_on_plan``.

    The log-odds by the plan's walls are ``share_weight`` times the share of the observed walls that the map confirms,
    less ``middle_share``, plus ``margin_weight`` times the margin of the merger's score, less ``middle_margin``. They
    were chosen on 85 pairs of twelve missions (seeds 301 to 303) and drawn plans: right places confirm 0.87 to 1.00,
    but for plans with much furniture in the lines of walls; wrong ones 0.26 to 0.93.

    - ``margin_cap``: a larger margin counts as this;
    - ``min_score``: the walls overrule no answer that the merger scores less;
    - ``min_share``: with a smaller share the map contradicts the plan, which furniture does not explain; the confidence
      is then at most ``most_if_denied``, because furniture drawn like walls is denied, too;
    - ``min_lead``: another place on the plan with a share less than this below makes the answer ambiguous, if the
      margin of the merger's score is less than ``middle_margin``, too;
    - ``rival_part``: it counts if it confirms at least this part of the cells.
    """

    share_weight: float = 30.0
    middle_share: float = 0.905
    margin_weight: float = 8.0
    middle_margin: float = 0.12
    margin_cap: float = 0.25
    min_score: float = 0.4
    min_share: float = 0.75
    most_if_denied: float = 0.3
    min_lead: float = 0.02
    rival_part: float = 0.5

    def __post_init__(self) -> None:
        require_valid(
            self, shares=("middle_share", "middle_margin", "min_share", "min_lead", "rival_part", "most_if_denied")
        )


@dataclass(frozen=True)
class PlanVerdict:
    """Confidence that the place on this plan is right, other plans aside, and why it is refused, None if it is not."""

    confidence: float
    reason: str | None


def decide_on_plan(
    answer: PairResult,
    walls: WallAgreement,
    rivals: Sequence[WallAgreement],
    settings: PlanAcceptanceSettings = PlanAcceptanceSettings(),
    acceptance: AcceptanceSettings = AcceptanceSettings(),
) -> PlanVerdict:
    """Decide on a place by the greater of two confidences: the merger's, and that by the plan's walls.

    Placements that a symmetry makes alike share both. The merger asks both maps, and so counts furniture against the
    place. The walls ask only whether the map confirms the plan. ``rivals`` are those of other places on the plan. Both
    fail if the map denies too many walls.
    """
    evidence = answer.evidence
    if evidence is None or answer.reason not in DOUBTED or evidence.score < settings.min_score:
        return PlanVerdict(answer.confidence, answer.reason_text)
    by_walls = _by_walls(evidence, walls, settings)
    if walls.share < settings.min_share:
        confidence = min(max(by_walls, answer.confidence), settings.most_if_denied)
        return PlanVerdict(confidence, "the map shows free space where the plan has walls")
    ambiguous = margin(evidence) < settings.middle_margin and any(
        rival.share > walls.share - settings.min_lead and rival.confirmed >= settings.rival_part * walls.confirmed
        for rival in rivals
    )
    confidence = answer.confidence if ambiguous else max(by_walls, answer.confidence)
    if confidence >= acceptance.min_confidence:
        return PlanVerdict(confidence, None)
    return PlanVerdict(confidence, answer.reason_text or "confidence is below the asked")


def _by_walls(evidence: Evidence, walls: WallAgreement, settings: PlanAcceptanceSettings) -> float:
    capped = min(margin(evidence), settings.margin_cap)
    odds = settings.share_weight * (walls.share - settings.middle_share)
    odds += settings.margin_weight * (capped - settings.middle_margin)
    return float(expit(odds)) * evidence.precision_probability / (evidence.alike_placements or 1)
