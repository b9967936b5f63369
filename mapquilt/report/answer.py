"""One answer of a report: a pair of maps, what a method said of it, and what is true."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from mapping.geometry.similarity2 import Similarity2

Outcome = Literal["wrong", "missed", "right", "rightly refused", "not merged"]

OUTCOMES: tuple[Outcome, ...] = ("wrong", "missed", "right", "rightly refused", "not merged")
"""In the order in which they are shown: what went wrong comes first."""

OUTCOME_WORDS: dict[Outcome, str] = {
    "wrong": "accepted, but wrong",
    "missed": "refused, though there is one right answer",
    "right": "right and accepted",
    "rightly refused": "refused, as it must be or may be",
    "not merged": "not merged yet",
}


@dataclass(frozen=True)
class ReportAnswer:
    """What a row of the report tells. ``accepted`` is None where nothing was merged; ``truth`` is None for a pair that
    must be refused, ``answer`` where nothing was proposed. ``level`` is what a study varied, ``cluster`` the mission;
    ``seconds`` is the processor time of the pair; None is what is not told."""

    pair: str
    cluster: str
    target: Path
    source: Path
    method: str = ""
    level: str = ""
    world: str | None = None
    noise: float | None = None
    overlap: float | None = None
    negative: bool = False
    identifiable: bool = True
    bent: bool = False
    accepted: bool | None = None
    right: bool = False
    confidence: float | None = None
    rotation_deg: float | None = None
    scale_percent: float | None = None
    displacement_m: float | None = None
    displacement_cells: float | None = None
    reason: str | None = None
    score: float | None = None
    runner_up_score: float | None = None
    seconds: float | None = None
    answer: Similarity2 | None = None
    truth: Similarity2 | None = None
    runner_up: Similarity2 | None = None

    @property
    def asked(self) -> bool:
        """Whether there is one right answer to be found."""
        return not self.negative and self.identifiable

    @property
    def outcome(self) -> Outcome:
        if self.accepted is None:
            return "not merged"
        if self.accepted:
            return "right" if self.right else "wrong"
        return "missed" if self.asked else "rightly refused"


def methods_of(answers: tuple[ReportAnswer, ...]) -> tuple[str, ...]:
    """The methods that answered, in order."""
    return tuple(dict.fromkeys(one.method for one in answers if one.accepted is not None))
