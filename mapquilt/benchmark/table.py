"""Tables of a benchmark: Markdown to keep, a short form for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from rich.table import Table

from mapquilt.benchmark.comparison import Comparison
from mapquilt.benchmark.exchange.answers import ANSWERED
from mapquilt.benchmark.results import REFERENCE, BenchmarkResults, StratumResult, Timing
from mapquilt.evaluation.calibration import Calibration
from mapquilt.evaluation.formatting import false_accept_text, number_text, share_text
from mapquilt.viz.text_table import plain_table
from merge.settings import PUBLISHED

COLUMNS = (
    *("stratum", "method", "ran", "pairs", "right", "true accepts", "false accepts", "accepted right"),
    *("deg", "%", "cells", "s"),
    f"x {REFERENCE}",
)
COMPARISON_COLUMNS = ("outcome", "comparison", "pairs", "worlds", "alone", "points", "p", "p, Holm", "detectable")
CALIBRATION_COLUMNS = ("method", "pairs", "Brier", "Brier of base rate", "ECE", "AUC", "NEES")

WORDS = ("stratum", "method", "ran", "outcome", "comparison")
"""Columns that do not hold numbers."""

EXPLANATION = """\
Right: within 2 degrees, 3 % of scale and a mean displacement of the common cells of 1.5 % of the target's diagonal.
True accepts: right and accepted. Shares in per cent with Wilson's 95 % interval. False accepts: accepted answers that
are not right, any accepted negative among them; then the upper end of the share's interval in per cent. Accepted right:
share of right ones among all accepted answers. deg, %, cells: median errors of the right answers. s: median processor
time of a pair on one thread; the ratio is that of medians.
Ran: as published, by the rule of the method itself; verified, with the common verification and acceptance; or answers
of another program, with the times that it states.
"""

OVER_WORLDS = """\
In square brackets the interval of a bootstrap over worlds, since pairs of one world are not independent; where all
pairs or none count, Wilson's interval with each world counted once.
"""


def markdown(results: BenchmarkResults) -> str:
    """Write the whole table, and the calibration."""
    parts = ["# Benchmark\n", EXPLANATION]
    if any(row.aggregate.clustered for row in results.strata):
        parts.append(OVER_WORLDS)
    for group, rows in groupby(results.strata, key=lambda row: row.group):
        parts += [f"## {group[0].upper()}{group[1:]}\n", _markdown_table(COLUMNS, [stratum_cells(row) for row in rows])]
    if results.comparisons:
        parts += ["## Comparisons\n", comparisons_text(results.comparisons)]
        cells = [comparison_cells(one) for one in results.comparisons]
        parts.append(_markdown_table(COMPARISON_COLUMNS, cells))
    if results.calibrations:
        rows_of_cells = [calibration_cells(found) for found in results.calibrations]
        parts += ["## Calibration\n", _markdown_table(CALIBRATION_COLUMNS, rows_of_cells)]
    return "\n".join(parts)


def _markdown_table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    rule = ["---" if column in WORDS else "---:" for column in columns]
    return "".join("| " + " | ".join(cells) + " |\n" for cells in (columns, rule, *rows))


def stratum_cells(row: StratumResult) -> tuple[str, ...]:
    """Format a row under ``COLUMNS``."""
    found, over = row.aggregate, row.aggregate.clustered
    errors = found.errors_right
    medians = [(errors["rotation_deg"], 3), (errors["scale_percent"], 3), (errors["displacement_cells"], 2)]
    return (
        row.stratum,
        *_name_and_way(row.method),
        str(found.pairs),
        share_text(found.right, over.get("right")),
        share_text(found.true_accepts, over.get("true_accepts")),
        false_accept_text(found.false_accepts, over.get("false_accepts")),
        share_text(found.accepted_right, over.get("accepted_right")),
        *(number_text(None if error is None else error.median, places) for error, places in medians),
        number_text(None if row.timing is None else row.timing.median_s, 3),
        _ratio_text(row.timing),
    )


def _name_and_way(method: str) -> tuple[str, str]:
    """Split the title of a method into its name and the way in which it ran."""
    for ending, way in ((PUBLISHED, PUBLISHED.strip()), (ANSWERED, "answers")):
        if method.endswith(ending):
            return method.removesuffix(ending), way
    return method, "verified"


def _ratio_text(timing: Timing | None) -> str:
    if timing is None or timing.ratio is None or timing.interval is None:
        return "-"
    return f"{timing.ratio:.2f} ({timing.interval.low:.2f} to {timing.interval.high:.2f})"


def comparisons_text(found: Sequence[Comparison]) -> str:
    """Explain the comparisons, with their number."""
    return f"""\
{len(found)} comparisons on the same pairs, by an exact sign-flip test over worlds, with Holm's correction for all.
True accepts are those of all positives, false accepts those of every pair. Alone: pairs with this outcome by one method
only. Points: difference of the shares in per cent, with a bootstrap interval over worlds. Detectable: the smallest
difference that would be found with 80 % power.
"""


def comparison_cells(one: Comparison) -> tuple[str, ...]:
    """Format a row under ``COMPARISON_COLUMNS``."""
    words = "not shown to differ from"
    if one.shown:
        words = "has more than" if one.difference > 0.0 else "has fewer than"
    interval = "" if one.interval is None else f" ({100 * one.interval.low:+.1f} to {100 * one.interval.high:+.1f})"
    return (
        one.outcome,
        f"{one.method} {words} {one.other}",
        str(one.pairs),
        str(one.worlds),
        f"{one.method_alone} : {one.other_alone}",
        f"{100 * one.difference:+.1f}{interval}",
        *(f"{p:.2g}" for p in (one.p, one.p_holm)),
        number_text(None if one.detectable is None else 100 * one.detectable, 1),
    )


def calibration_cells(found: Calibration) -> tuple[str, ...]:
    """Format a row under ``CALIBRATION_COLUMNS``."""
    scores = (found.brier, found.base_brier, found.ece, found.auc)
    return (found.method, str(found.pairs), *(number_text(score, 4) for score in scores), number_text(found.nees, 1))


def terminal_table(results: BenchmarkResults) -> Table:
    """Tabulate all positives, all negatives, and every pair in 80 columns: counts, median error and time."""
    names = ("pairs", "true\naccepts\n[%]", "false\naccepts", "error\n[cells]", "time\n[s]")
    table = plain_table(("stratum", False), ("method", False), ("ran", False), *((name, True) for name in names))
    for row in results.strata:
        if row.stratum == "all":
            share, error = row.aggregate.true_accepts, row.aggregate.errors_right["displacement_cells"]
            table.add_row(
                row.group,
                *_name_and_way(row.method),
                str(row.aggregate.pairs),
                number_text(None if share is None else 100.0 * share.value, 1),
                str(row.aggregate.false_accepts.count if row.aggregate.false_accepts else 0),
                number_text(None if error is None else error.median, 2),
                number_text(None if row.timing is None else row.timing.median_s, 3),
            )
    return table


def calibration_table(results: BenchmarkResults) -> Table:
    """Tabulate the calibration of each method that claims a probability."""
    table = plain_table(*((name, name != "method") for name in CALIBRATION_COLUMNS))
    for found in results.calibrations:
        table.add_row(*calibration_cells(found))
    return table
