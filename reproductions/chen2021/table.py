"""Tables of the reproduction: Markdown, CSV, and a short one for the terminal."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from rich.table import Table

from mapquilt.evaluation.pair_rows import csv_text
from mapquilt.evaluation.statistics import Share
from mapquilt.viz.text_table import plain_table
from reproductions.chen2021.cases import CASES, Case
from reproductions.chen2021.make import Study
from reproductions.chen2021.methods import CORRECTED, PLAIN
from reproductions.chen2021.tally import CaseTally

OURS = "quilt"
MISSING = "-"


def markdown(study: Study, counted: Sequence[CaseTally]) -> str:
    """Write the whole report."""
    parts = [
        "# Reproduction of Chen (2021)",
        f"Seeds per case: {study.spec.seeds}. An answer is right within 10 cells, 5 degrees and 5 % of scale. Shares "
        "have Wilson's 95 % interval; the acceptance index (AI) is a median on the original rasters. The values of the "
        "thesis are those of its own scripts on its author's maps.",
        "## The two pipelines as published",
        compact(counted),
        "## Every method",
        "Right, %, and in brackets the number of false accepts. `as published` a method decides for itself; the others "
        "use the common acceptance.",
        overview(study.spec.methods, counted),
        "## Every method, case by case",
        "Errors are medians of the right answers, for the three robots the greatest of any two; seconds are medians of "
        "the processor time of a pair, or of all three.",
        *(_of_case(case, counted) for case in CASES),
    ]
    return "\n\n".join(parts) + "\n"


def compact(counted: Sequence[CaseTally]) -> str:
    """Tabulate thesis and reproduction side by side, for the two pipelines and ``quilt``."""
    head = ("case", "differs by", "overlap", "SIFT, thesis", "SIFT %", "corrected, thesis", "corrected %", "AI SIFT")
    with_ours = any(one.method == OURS for one in counted)
    rows = [(*head, "AI corrected", "AI at the truth", *((f"{OURS} %",) if with_ours else ()))]
    for case in CASES:
        found = {one.method: one for one in counted if one.case.name == case.name}
        if not {PLAIN, CORRECTED} <= found.keys():
            continue
        plain, corrected = found[PLAIN], found[CORRECTED]
        measured = case.measured
        rows.append(
            (
                case.name,
                case.differs,
                _percent(plain.overlap),
                MISSING if measured is None else measured.plain_text,
                _share(plain.right),
                MISSING if measured is None else measured.corrected_text,
                _share(corrected.right),
                _number(plain.index, 3) + ("" if measured is None else f" ({measured.plain_index:.3f})"),
                _number(corrected.index, 3),
                _number(plain.true_index, 3) + ("" if measured is None else f" ({measured.true_index:.3f})"),
                *((_share(found[OURS].right),) if with_ours else ()),
            )
        )
    return _rows(rows) + "\n\nIn brackets beside an AI: the thesis's."


def overview(methods: Sequence[str], counted: Sequence[CaseTally]) -> str:
    """Tabulate per cent right by method and case, and false accepts in brackets if there are any."""
    by_place = {(one.case.name, one.method): one for one in counted}
    head = ("method", *(case.name for case in CASES))
    rows = [(method, *(_overview_cell(by_place[case.name, method]) for case in CASES)) for method in methods]
    return _rows([head, *rows])


def _overview_cell(one: CaseTally) -> str:
    wrong = f" ({one.false_accepts})" if one.false_accepts else ""
    return f"{100 * one.right.value:.0f}{wrong}"


HEAD = ("method", "right %", "true accepts %", "false accepts", "deg", "%", "cells", "AI", "AI at the truth", "s")


def _of_case(case: Case, counted: Sequence[CaseTally]) -> str:
    rows = [HEAD] + [_row(one) for one in counted if one.case.name == case.name]
    return f"### {case.title}\n\n" + _rows(rows)


def _row(one: CaseTally) -> tuple[str, ...]:
    return (
        one.method,
        _share(one.right),
        _share(one.true_accepts),
        str(one.false_accepts),
        _number(one.median_error("rotation_deg"), 2),
        _number(one.median_error("scale_percent"), 2),
        _number(one.median_error("displacement_cells"), 1),
        _number(one.index, 3),
        _number(one.true_index, 3),
        f"{one.seconds:.2f}",
    )


def _rows(rows: Sequence[Sequence[str]]) -> str:
    rule = ["---", *("---:" for _ in rows[0][1:])]
    return "\n".join("| " + " | ".join(row) + " |" for row in (rows[0], rule, *rows[1:]))


def _share(share: Share) -> str:
    return f"{100 * share.value:.0f} [{100 * share.interval.low:.0f}, {100 * share.interval.high:.0f}]"


def _number(value: float | None, digits: int) -> str:
    return MISSING if value is None else f"{value:.{digits}f}"


SHOWN = (PLAIN, CORRECTED, "sift", "morphology", OURS)
"""Methods that the terminal has room for."""


def terminal_table(counted: Sequence[CaseTally]) -> Table:
    """Tabulate the shares of right answers by case, in per cent: of the thesis, and of the main methods."""
    shown = [method for method in SHOWN if any(one.method == method for one in counted)]
    head = ("overlap", "thesis: SIFT", "thesis: corrected", *shown)
    table = plain_table(("right [%]", False), *((name, True) for name in head))
    by_place = {(one.case.name, one.method): one for one in counted}
    for case in CASES:
        overlap = next(one.overlap for one in counted if one.case == case)
        thesis = (MISSING, MISSING)
        if case.measured is not None:
            thesis = (case.measured.plain_text, case.measured.corrected_text)
        shares = (f"{100 * by_place[case.name, method].right.value:.0f}" for method in shown)
        table.add_row(case.name, _percent(overlap), *thesis, *shares)
    return table


def _percent(share: float | None) -> str:
    return MISSING if share is None else f"{100 * share:.0f} %"


PAIR_COLUMNS = (
    *("method", "outcome", "right", "accepted", "confidence", "rotation_deg", "scale_percent", "displacement_cells"),
    *("x", "y", "yaw", "scale"),
)
CASE_COLUMNS = (
    *("case", "differs_by", "method", "overlap", "runs", "right", "right_low", "right_high", "true_accepts"),
    *("true_accepts_low", "true_accepts_high", "false_accepts", "rotation_deg", "scale_percent", "displacement_cells"),
    *("index", "true_index", "thesis_right", "thesis_runs", "thesis_index", "thesis_true_index"),
)


def table_csv(counted: Sequence[CaseTally]) -> str:
    """Write a row for each case and method, without times; what does not apply is left empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(CASE_COLUMNS)
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
