"""The study as tables to compute with."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from reproductions.chen2021.make import Study
from reproductions.chen2021.methods import CORRECTED, PLAIN
from reproductions.chen2021.tally import CaseTally

COLUMNS = (
    *("case", "differs_by", "method", "overlap", "runs", "right", "right_low", "right_high", "right_and_accepted"),
    *("accepted_low", "accepted_high", "wrong_accepts", "rotation_deg", "scale_percent", "displacement_cells"),
    *("index", "true_index", "thesis_right", "thesis_runs", "thesis_index", "thesis_true_index"),
)


def table_csv(counted: Sequence[CaseTally]) -> str:
    """A row a case and method; what does not apply is left empty. No times: the same call gives the same."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for one in counted:
        right, accepted = one.right, one.right_and_accepted
        writer.writerow(
            (
                *(one.case.name, one.case.differs, one.method, one.overlap, right.of),
                *(right.count, right.interval.low, right.interval.high),
                *(accepted.count, accepted.interval.low, accepted.interval.high, one.wrong_accepts),
                *(one.rotation_deg, one.scale_percent, one.displacement_cells, one.index, one.true_index),
                *_measured(one),
            )
        )
    return text.getvalue()


def _measured(one: CaseTally) -> tuple[float | None, ...]:
    measured = one.case.measured
    if measured is None or one.method not in (PLAIN, CORRECTED):
        return (None, None, None, None if measured is None else measured.true_index)
    if one.method == PLAIN:
        return (measured.plain, measured.plain_runs, measured.plain_index, measured.true_index)
    runs = None if measured.corrected is None else measured.corrected_runs
    return (measured.corrected, runs, None, measured.true_index)


def answers_csv(study: Study) -> str:
    """A row an answer."""
    text = io.StringIO()
    columns = ["case", "seed", "method", "right", "accepted", "confidence", "rotation_deg", "scale_percent"]
    columns += ["displacement_cells", "index", "true_index", "x", "y", "yaw", "scale"]
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    for answer in study.answers:
        record = answer.record()
        place = record.pop("transform")
        writer.writerow(record | ({} if place is None else dict(zip(("x", "y", "yaw", "scale"), place, strict=True))))
    return text.getvalue()


def timings_csv(study: Study) -> str:
    """The processor seconds of each answer."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("case", "seed", "method", "seconds"))
    for answer, seconds in zip(study.answers, study.seconds, strict=True):
        writer.writerow((answer.case, answer.seed, answer.method, f"{seconds:.4f}"))
    return text.getvalue()
