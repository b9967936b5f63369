"""The study's answers, counted by case and method."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from statistics import median

from mapquilt.evaluation.statistics import Share
from reproductions.chen2021.cases import CASES, Case
from reproductions.chen2021.make import Study


@dataclass(frozen=True)
class CaseTally:
    """Of one case and method: the median true overlap of the two maps, as a share of the smaller; share right, share
    right and accepted, accepted though wrong; median errors of the right answers; median acceptance index at the
    answers and at the truth; median seconds. None where nothing is to be counted."""

    case: Case
    method: str
    overlap: float | None
    right: Share
    right_and_accepted: Share
    wrong_accepts: int
    rotation_deg: float | None
    scale_percent: float | None
    displacement_cells: float | None
    index: float | None
    true_index: float | None
    seconds: float


def tallies(study: Study, overlaps: Mapping[str, float]) -> list[CaseTally]:
    """One for each case and method, by case; ``overlaps`` by case."""
    return [_tally(study, case, method, overlaps.get(case.name)) for case in CASES for method in study.spec.methods]


def _tally(study: Study, case: Case, method: str, overlap: float | None) -> CaseTally:
    timed = zip(study.answers, study.seconds, strict=True)
    chosen = [(answer, seconds) for answer, seconds in timed if (answer.case, answer.method) == (case.name, method)]
    answers = [answer for answer, _ in chosen]
    right = [answer for answer in answers if answer.right]
    return CaseTally(
        case,
        method,
        overlap,
        Share.counted([answer.right for answer in answers]),
        Share.counted([answer.right and answer.accepted for answer in answers]),
        sum(answer.accepted and not answer.right for answer in answers),
        _median([answer.rotation_deg for answer in right]),
        _median([answer.scale_percent for answer in right]),
        _median([answer.displacement_cells for answer in right]),
        _median([answer.index for answer in answers]),
        _median([answer.true_index for answer in answers]),
        median(seconds for _, seconds in chosen),
    )


def _median(values: list[float | None]) -> float | None:
    told = [value for value in values if value is not None]
    return median(told) if told else None
