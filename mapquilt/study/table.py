"""Tables of a study for the terminal and the report."""

from __future__ import annotations

from rich.table import Table

from mapquilt.evaluation.formatting import false_accept_text, number_text, share_text
from mapquilt.study.paired import ALL_LEVELS, PairedTest
from mapquilt.study.results import Cell, CellTime, StudyResults
from mapquilt.viz.text_table import plain_table

NUMBERS = ("pairs", "true accepts", "false accepts", "deg", "%", "m", "AI", "IoU free", "F1 walls", "s a pair")


def level_table(results: StudyResults) -> Table:
    """Tabulate each level and method in 80 columns: counts, median displacement, quality and time."""
    names = [one.variable.name for one in results.plan.varied]
    numbers = ("pairs", "true\naccepts\n[%]", "false\naccepts", "error\n[m]", "free\nIoU", "wall\nF1", "time\n[s]")
    table = plain_table(*((name, False) for name in (*names, "method")), *((name, True) for name in numbers))
    times = {(time.level, time.method): time for time in results.times}
    for cell in results.cells:
        found, time = cell.pairs, times.get((cell.level, cell.method))
        displacement = found.errors_accepted["displacement_m"]
        table.add_row(
            *cell.level,
            cell.method,
            str(found.asked),
            number_text(None if found.true_accepts is None else 100.0 * found.true_accepts.value, 1),
            str(found.false_accepts.count if found.false_accepts else 0),
            number_text(None if displacement is None else displacement.median, 3),
            number_text(None if cell.iou_free is None else cell.iou_free.value, 3),
            number_text(None if cell.f1_walls is None else cell.f1_walls.value, 3),
            number_text(None if time is None else time.median_s, 2),
        )
    return table


def cell_texts(cell: Cell, time: CellTime | None) -> tuple[str, ...]:
    """Format method and ``NUMBERS``: shares in per cent with intervals, median to 90th percentile of the errors."""
    found = cell.pairs
    errors = [(found.errors_accepted[name], places) for name, places in ERROR_PLACES]
    return (
        cell.method,
        str(found.asked),
        share_text(found.true_accepts),
        false_accept_text(found.false_accepts),
        *("-" if one is None else f"{one.median:.{places}f} to {one.p90:.{places}f}" for one, places in errors),
        number_text(found.acceptance_index, 3),
        number_text(None if cell.iou_free is None else cell.iou_free.value, 3),
        number_text(None if cell.f1_walls is None else cell.f1_walls.value, 3),
        number_text(None if time is None else time.median_s, 2),
    )


ERROR_PLACES = (("rotation_deg", 2), ("scale_percent", 2), ("displacement_m", 3))


def verdict_table(results: StudyResults) -> Table:
    """Tabulate each two methods that a test separates at some level, and all levels together, in 80 columns."""
    table = plain_table(
        ("level", False), ("methods", False), ("difference\n[points]", True), ("alone", True), ("p, Holm", True)
    )
    for test in results.tests:
        if test.level == ALL_LEVELS or test.verdict != "no difference shown":
            level, _, difference, alone, p = verdict_texts(test)
            methods = f"{test.method}\n{VERDICTS[test.verdict]}\n{test.other}"
            table.add_row(level, methods, difference.replace(" (", "\n("), alone, p)
    return table


VERDICTS = {
    "better": "better than",
    "worse": "worse than",
    "no difference shown": "not shown to differ from",
}


def verdict_texts(test: PairedTest) -> tuple[str, ...]:
    """Format level, verdict, difference of the shares in points with its interval, true accepts of one alone, p."""
    interval = "" if test.interval is None else f" ({100 * test.interval.low:+.1f} to {100 * test.interval.high:+.1f})"
    return (
        " ".join(test.level),
        f"{test.method} {VERDICTS[test.verdict]} {test.other}",
        f"{100 * test.difference:+.1f}{interval}",
        f"{test.method_alone} : {test.other_alone}",
        f"{test.p_holm:.2g}",
    )
