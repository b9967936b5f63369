"""Acceptance: the verdict on the evidence for an answer."""

from __future__ import annotations

from scipy.special import expit

from merge.records.evidence import Evidence
from merge.records.verdict import Reason, Verdict
from merge.verification.settings import AcceptanceSettings


def decide(evidence: Evidence, settings: AcceptanceSettings = AcceptanceSettings()) -> Verdict:
    """Accept an answer that is certain enough and meets all minima.

    The confidence is the probability that the place is right times that of sufficient precision; it rises with every
    piece of evidence. Placements that a symmetry makes alike share it. A refusal names the largest deficit: a second
    best answer, if without it the answer would be worth more; else contradiction or overlap; or the symmetry; or that
    more confidence was asked than the default, which is met.
    """
    odds, reason = _log_odds(evidence, settings), _lacking(evidence, settings)
    for missing, value, needed in requirements(evidence, settings):
        if value < needed:
            odds, reason = min(odds, value / needed - 1.0 - settings.missing_log_odds), missing
            break
    place = float(expit(odds))
    alone = place * evidence.precision_probability
    confidence = alone / (evidence.alike_placements or 1)
    if place >= settings.min_confidence:
        reason = Reason.IMPRECISE if alone < settings.min_confidence else Reason.SYMMETRIC
    elif reason is Reason.AMBIGUOUS and (evidence.alike_placements or 1) > 1:
        reason = Reason.SYMMETRIC
    if confidence >= settings.min_confidence:
        return Verdict(True, confidence, None)
    if confidence >= AcceptanceSettings.min_confidence:
        return Verdict.refuse(Reason.LOW_CONFIDENCE, confidence, f" {settings.min_confidence:g}, at {confidence:.6g}")
    return Verdict.refuse(reason, confidence)


def margin(evidence: Evidence) -> float:
    """Return the score less the second best score, at least 0."""
    return max(0.0, evidence.score - evidence.second_best_score)


def features(evidence: Evidence, settings: AcceptanceSettings) -> tuple[float, float, float]:
    """Return the margin, at most its cap, the contradiction and the conflict, which the weights multiply."""
    return min(margin(evidence), settings.margin_cap), evidence.local_violation or 0.0, evidence.conflict_ratio or 0.0


def _log_odds(evidence: Evidence, settings: AcceptanceSettings) -> float:
    return settings.margin_weight * features(evidence, settings)[0] - _against(evidence, settings) - settings.threshold


def _against(evidence: Evidence, settings: AcceptanceSettings) -> float:
    """Return the log-odds that an answer loses by contradiction."""
    _, contradiction, conflict = features(evidence, settings)
    return settings.contradiction_weight * contradiction + settings.conflict_weight * conflict


def requirements(evidence: Evidence, settings: AcceptanceSettings) -> tuple[tuple[Reason, float, float], ...]:
    """List the minima that an answer must meet: the reason of a refusal below it, the value and the minimum.

    They are those of the length of matched walls, the spread of their normals, the overlap, the score, and the margin.
    """
    return (
        (Reason.LITTLE_STRUCTURE, evidence.inlier_length_cells, settings.min_inlier_length_cells),
        (Reason.PARALLEL_WALLS, evidence.normal_isotropy, settings.min_normal_isotropy),
        (Reason.LITTLE_OVERLAP, evidence.overlap, settings.min_overlap),
        (_lacking(evidence, settings), evidence.score, settings.min_score),
        (Reason.AMBIGUOUS, margin(evidence), settings.min_relative_margin * evidence.score),
    )


def _lacking(evidence: Evidence, settings: AcceptanceSettings) -> Reason:
    if evidence.score >= settings.min_score:
        without_rival = min(evidence.score, settings.margin_cap)
        by_rival = settings.margin_weight * (without_rival - min(margin(evidence), settings.margin_cap))
        if by_rival > _against(evidence, settings):
            return Reason.AMBIGUOUS
        return Reason.FREE_SPACE_VIOLATION
    share = evidence.wall_inlier_ratio or 0.0
    by_contradiction, by_little_overlap = 1.0 - share**2, share**2 - evidence.score
    return Reason.FREE_SPACE_VIOLATION if by_contradiction > by_little_overlap else Reason.LITTLE_OVERLAP
