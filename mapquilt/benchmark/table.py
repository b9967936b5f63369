"""The table of a benchmark: Markdown to keep, a short form for the terminal."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from itertools import groupby

from rich.table import Table

from mapquilt.benchmark.report import Report
from mapquilt.cli.tables import plain_table
from mapquilt.evaluation.aggregation import REFERENCE, Tally, Timing
from mapquilt.evaluation.calibration import Calibration
from mapquilt.evaluation.statistics import Interval, Share

COLUMNS = (
    "stratum",
    "method",
    "pairs",
    "right",
    "right and accepted",
    "wrong accepts",
    "deg",
    "%",
    "cells",
    "s",
    f"x {REFERENCE}",
)

EXPLANATION = """\
Right: within 2 degrees, 3 % of scale and a mean displacement of the common cells of 1.5 % of the target's diagonal.
Shares in per cent with Wilson's 95 % interval. Wrong accepts: answers that were accepted and not right, any accepted
negative among them; then the upper end of the share's interval in per cent. deg, %, cells: median errors of the right
answers. s: median seconds of the processor for a pair on one thread; the ratio is that of medians.
"""

OVER_MISSIONS = """\
In square brackets the interval of a bootstrap over missions, since pairs of one mission are not independent.
"""


def markdown(report: Report) -> str:
    """The whole table, and the calibration."""
    rows = list(zip(report.tallies, report.timings, strict=True))
    parts = ["# Benchmark\n", EXPLANATION]
    if any(tally.over_missions for tally in report.tallies):
        parts.append(OVER_MISSIONS)
    for group, entries in groupby(rows, key=lambda row: row[0].group):
        parts += [f"## {group[0].upper()}{group[1:]}\n", _markdown_table(COLUMNS, [_cells(*row) for row in entries])]
    if report.calibrations:
        columns = ("method", "pairs", "Brier", "Brier of the base rate", "ECE, 10 bins of equal mass", "AUC", "NEES")
        parts += ["## Calibration\n", _markdown_table(columns, [calibration_cells(c) for c in report.calibrations])]
    return "\n".join(parts)


def _markdown_table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    numbers = ("stratum", "method")
    rule = ["---" if column in numbers else "---:" for column in columns]
    lines = [_line(cells) for cells in (columns, rule, *rows)]
    return "\n".join(lines) + "\n"


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _cells(tally: Tally, timing: Timing) -> tuple[str, ...]:
    told = tally.over_missions
    return (
        tally.stratum,
        tally.method,
        str(tally.pairs),
        share_text(tally.right, told.get("right")),
        share_text(tally.right_and_accepted, told.get("right_and_accepted")),
        wrong_text(tally.wrong_accepts, told.get("wrong_accepts")),
        number_text(tally.rotation_deg, 3),
        number_text(tally.scale_percent, 3),
        number_text(tally.displacement_cells, 2),
        f"{timing.median_s:.3f}",
        _ratio_text(timing),
    )


def share_text(share: Share | None, over_missions: Interval | None = None) -> str:
    """Such as ``95.0 (83.5 to 98.6)``; a dash where there is nothing to be right about."""
    if share is None:
        return "-"
    text = f"{100 * share.value:.1f} ({_interval_text(share.interval)})"
    return text if over_missions is None else f"{text} [{_interval_text(over_missions)}]"


def wrong_text(share: Share, over_missions: Interval | None = None) -> str:
    """Such as ``0 (up to 8.8)``."""
    text = f"{share.count} (up to {100 * share.interval.high:.1f})"
    return text if over_missions is None else f"{text} [{_interval_text(over_missions)}]"


def _interval_text(interval: Interval) -> str:
    return f"{100 * interval.low:.1f} to {100 * interval.high:.1f}"


def number_text(value: float | None, places: int) -> str:
    """The number, or a dash where there is none."""
    return "-" if value is None else f"{value:.{places}f}"


def _ratio_text(timing: Timing) -> str:
    if timing.ratio is None or timing.interval is None:
        return "-"
    return f"{timing.ratio:.2f} ({timing.interval.low:.2f} to {timing.interval.high:.2f})"


def calibration_cells(found: Calibration) -> tuple[str, ...]:
    """Method, pairs, Brier, Brier of the base rate, ECE, AUC, mean normalised squared error."""
    return (
        found.method,
        str(found.pairs),
        f"{found.brier:.4f}",
        f"{found.base_brier:.4f}",
        f"{found.ece:.4f}",
        number_text(found.auc, 4),
        number_text(found.nees, 1),
    )


def terminal_table(report: Report) -> Table:
    """The strata that hold all positives, all negatives, and every pair, without the intervals over missions."""
    table = plain_table(*((column, column not in ("stratum", "method")) for column in COLUMNS))
    for tally, timing in zip(report.tallies, report.timings, strict=True):
        if tally.stratum == "all":
            bare = dataclasses.replace(tally, over_missions={})
            table.add_row(tally.group, *_cells(bare, timing)[1:])
    return table


def calibration_table(report: Report) -> Table:
    """Brier score, expected calibration error, AUC and normalised error of each method that claims a probability."""
    names = ("method", "pairs", "Brier", "base rate's", "ECE", "AUC", "NEES")
    table = plain_table(*((name, name != "method") for name in names))
    for found in report.calibrations:
        table.add_row(*calibration_cells(found))
    return table
