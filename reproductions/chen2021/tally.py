"""The study's answers, counted by case and method."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from statistics import median

from mapquilt.evaluation.intervals import Share
from mapquilt.evaluation.transform_error import THESIS
from reproductions.chen2021.answers import StudyAnswer
from reproductions.chen2021.cases import CASES, Case
from reproductions.chen2021.make import Study


@dataclass(frozen=True)
class CaseTally:
    """Of one case and method: the median true overlap of the two maps, as a share of the smaller; share right, share
    right and accepted, accepted though wrong; median errors of the right answers; median acceptance index at the
    answers and at the truth; median seconds. None where nothing is to be counted.

    Of the answers that are not right, ``nearly`` counts those within three times the bounds, and ``collapsed`` those
    that are less than half as large as they should be."""

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
    nearly: int = 0
    collapsed: int = 0


NEARLY = 3.0
COLLAPSED = 0.5


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
        sum(_is_nearly_right(answer) for answer in answers),
        sum(
            not answer.right and answer.transform is not None and answer.transform[3] < COLLAPSED for answer in answers
        ),
    )


def _is_nearly_right(answer: StudyAnswer) -> bool:
    bounds = (
        (answer.rotation_deg, THESIS.rotation_deg),
        (answer.scale_percent, THESIS.scale_percent),
        (answer.displacement_cells, THESIS.displacement_cells),
    )
    return not answer.right and all(error is not None and error <= NEARLY * most for error, most in bounds)


def _median(values: list[float | None]) -> float | None:
    told = [value for value in values if value is not None]
    return median(told) if told else None
