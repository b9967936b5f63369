"""Verdicts on an answer, and the reasons of refusals."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Reason(Enum):
    """A reason for a refusal. The value is a stable identifier; ``Refusal`` has the text for people."""

    NOTHING_PROPOSED = "nothing_proposed"
    LITTLE_STRUCTURE = "little_structure"
    PARALLEL_WALLS = "parallel_walls"
    LITTLE_OVERLAP = "little_overlap"
    FREE_SPACE_VIOLATION = "free_space_violation"
    AMBIGUOUS = "ambiguous"
    SYMMETRIC = "symmetric"
    IMPRECISE = "imprecise"
    OTHER_SCALE = "other_scale"
    OUTSIDE_SCALES = "outside_scales"
    MIRRORED = "mirrored"
    CONTRADICTS_PRIOR = "contradicts_prior"
    CONTRADICTS_TEAM = "contradicts_team"
    NO_PREDICTED_OVERLAP = "no_predicted_overlap"
    NOT_SELECTED = "not_selected"
    NO_PUBLISHED_ANSWER = "no_published_answer"
    PUBLISHED_RULE = "published_rule"
    LOW_CONFIDENCE = "low_confidence"


_TEXTS = {
    Reason.NOTHING_PROPOSED: "nothing was proposed",
    Reason.LITTLE_STRUCTURE: "too little structure",
    Reason.PARALLEL_WALLS: (
        "too little structure: the walls in common all run one way, and the answer may slide along them"
    ),
    Reason.LITTLE_OVERLAP: "too little overlap",
    Reason.FREE_SPACE_VIOLATION: "walls contradict free space",
    Reason.AMBIGUOUS: "two answers equally good",
    Reason.SYMMETRIC: "this place looks the same turned by 180 degrees: give a prior",
    Reason.IMPRECISE: "the place is found, but too little structure in common to tell it exactly",
    Reason.OTHER_SCALE: "fits only at another scale than the maps state",
    Reason.OUTSIDE_SCALES: "fits only at a scale outside of the searched range",
    Reason.MIRRORED: "fits only mirrored: one of the two maps is a mirror image",
    Reason.CONTRADICTS_PRIOR: "contradicts the given start poses",
    Reason.CONTRADICTS_TEAM: "contradicts the rest of the team",
    Reason.NO_PREDICTED_OVERLAP: "not tried: they share too little where the team puts them",
    Reason.NOT_SELECTED: "not tried: other pairs of these maps promised more",
    Reason.NO_PUBLISHED_ANSWER: "the method found nothing",
    Reason.PUBLISHED_RULE: "",
    Reason.LOW_CONFIDENCE: "confidence is below the asked",
}
_WITH_DETAIL = (Reason.OTHER_SCALE, Reason.OUTSIDE_SCALES, Reason.CONTRADICTS_PRIOR, Reason.LOW_CONFIDENCE)


@dataclass(frozen=True)
class Refusal:
    """A reason, and a detail that its text ends with: the scale that would fit, how far the answer is from
    the prior, the least confidence asked, the score of a published method."""

    reason: Reason
    detail: str = ""

    def __str__(self) -> str:
        return _TEXTS[self.reason] + self.detail

    @staticmethod
    def from_text(text: str) -> Refusal:
        """Parse the text of a refusal, as records hold it. A text of no known reason is that of a published rule."""
        for reason, known in _TEXTS.items():
            if text == known:
                return Refusal(reason)
        for reason in _WITH_DETAIL:
            if text.startswith(_TEXTS[reason]):
                return Refusal(reason, text.removeprefix(_TEXTS[reason]))
        return Refusal(Reason.PUBLISHED_RULE, text)


@dataclass(frozen=True)
class Verdict:
    """Accept or refuse an answer; ``refusal`` is None if it is accepted."""

    accepted: bool
    confidence: float
    refusal: Refusal | None

    @property
    def reason(self) -> Reason | None:
        """Reason of the refusal, None if the answer is accepted."""
        return None if self.refusal is None else self.refusal.reason

    @staticmethod
    def refuse(reason: Reason, confidence: float = 0.0, detail: str = "") -> Verdict:
        return Verdict(False, confidence, Refusal(reason, detail))
