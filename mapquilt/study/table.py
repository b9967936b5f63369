"""The tables of a study for the terminal."""

from __future__ import annotations

from rich.table import Table

from mapquilt.benchmark.table import number_text, share_text, wrong_text
from mapquilt.cli.tables import plain_table
from mapquilt.study.counting import Cell, CellTime
from mapquilt.study.paired import ALL_LEVELS, PairedTest
from mapquilt.study.results import StudyResults

NUMBERS = ("pairs", "right and accepted", "wrong accepts", "deg", "%", "m", "AI", "IoU free", "F1 walls", "s a pair")


def level_table(results: StudyResults) -> Table:
    """A row for each level and method: shares in per cent with intervals, median and 90th percentile of the errors."""
    names = [one.variable.name for one in results.plan.varied]
    table = plain_table(*((name, False) for name in (*names, "method")), *((name, True) for name in NUMBERS))
    times = {(time.level, time.method): time for time in results.times}
    for cell in results.cells:
        table.add_row(*cell.level, *cell_texts(cell, times.get((cell.level, cell.method))))
    return table


def cell_texts(cell: Cell, time: CellTime | None) -> tuple[str, ...]:
    """Method, pairs, and all that is told of them."""
    spreads = [(cell.rotation_deg, 2), (cell.scale_percent, 2), (cell.displacement_m, 3)]
    return (
        cell.method,
        str(cell.pairs),
        share_text(cell.right_and_accepted),
        "-" if cell.wrong_accepts is None else wrong_text(cell.wrong_accepts),
        *("-" if one is None else f"{one.median:.{places}f} to {one.p90:.{places}f}" for one, places in spreads),
        number_text(cell.acceptance_index, 3),
        number_text(None if cell.iou_free is None else cell.iou_free.value, 3),
        number_text(None if cell.f1_walls is None else cell.f1_walls.value, 3),
        "-" if time is None else f"{time.median_s:.2f}",
    )


def verdict_table(results: StudyResults) -> Table:
    """A row for each two methods that a test tells apart somewhere, and for all levels together."""
    table = plain_table(
        ("level", False),
        ("methods", False),
        ("difference", True),
        ("alone", True),
        ("p, Holm", True),
    )
    for test in results.tests:
        if test.level == ALL_LEVELS or test.verdict != "no difference shown":
            table.add_row(*verdict_texts(test))
    return table


def verdict_texts(test: PairedTest) -> tuple[str, ...]:
    """Level, verdict, difference of the shares in points with its interval, pairs that one alone had, p."""
    interval = "" if test.interval is None else f" ({100 * test.interval.low:+.1f} to {100 * test.interval.high:+.1f})"
    verdict = {"better": "better than", "worse": "worse than"}.get(test.verdict, "not shown to differ from")
    return (
        " ".join(test.level),
        f"{test.method} {verdict} {test.other}",
        f"{100 * test.difference:+.1f}{interval}",
        f"{test.method_alone} : {test.other_alone}",
        f"{test.p_holm:.2g}",
    )
