"""Tables of the reproduction as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from mapquilt.evaluation.pair_rows import csv_text
from reproductions.chen2021.make import Study
from reproductions.chen2021.methods import CORRECTED, PLAIN
from reproductions.chen2021.tally import CaseTally

PAIR_COLUMNS = (
    *("method", "outcome", "right", "accepted", "confidence", "rotation_deg", "scale_percent", "displacement_cells"),
    *("x", "y", "yaw", "scale"),
)
COLUMNS = (
    *("case", "differs_by", "method", "overlap", "runs", "right", "right_low", "right_high", "true_accepts"),
    *("true_accepts_low", "true_accepts_high", "false_accepts", "rotation_deg", "scale_percent", "displacement_cells"),
    *("index", "true_index", "thesis_right", "thesis_runs", "thesis_index", "thesis_true_index"),
)


def table_csv(counted: Sequence[CaseTally]) -> str:
    """Write a row for each case and method, without times; what does not apply is left empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for one in counted:
        right, accepted = one.right, one.true_accepts
        writer.writerow(
            (
                *(one.case.name, one.case.differs, one.method, one.overlap, right.of),
                *(right.count, right.interval.low, right.interval.high),
                *(accepted.count, accepted.interval.low, accepted.interval.high, one.false_accepts),
                *(one.median_error(name) for name in ("rotation_deg", "scale_percent", "displacement_cells")),
                *(one.index, one.true_index),
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
    """Write a row for each answer: case, seed, acceptance indices and the evaluated pair."""
    columns = ("case", "seed", "index", "true_index", *PAIR_COLUMNS)
    rows = ({name: (row | row["pair"])[name] for name in columns} for row in (one.record() for one in study.answers))
    return csv_text(rows, columns)


def timings_csv(study: Study) -> str:
    """Write the processor seconds of each answer."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("case", "seed", "method", "seconds"))
    for answer, seconds in zip(study.answers, study.seconds, strict=True):
        writer.writerow((answer.case, answer.seed, answer.pair.method, f"{seconds:.4f}"))
    return text.getvalue()
