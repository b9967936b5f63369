"""Short tables for the terminal."""

from __future__ import annotations

from rich import box
from rich.console import Console
from rich.table import Table

from mapping.map_set import MapSet, Unit
from mapquilt.run_score import PairScore, RunScore
from merge.result import MergeResult, PairResult

PLAIN_WIDTH = 160
"""Columns where the output is no terminal, so that rows do not break."""


def print_table(table: Table | str) -> None:
    """Print on standard output; colours only on a terminal. Names are printed as they are: brackets are no markup."""
    width = None if Console().is_terminal else PLAIN_WIDTH
    console = Console(highlight=False, markup=False, emoji=False, width=width)
    console.print(table, soft_wrap=isinstance(table, str))


def plain_table(*columns: tuple[str, bool]) -> Table:
    """An empty table of these columns; numbers (True) are aligned on the right."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, caption_justify="left")
    for name, number in columns:
        table.add_column(name, justify="right" if number else "left")
    return table


def _verdict(accepted: bool, reason: str | None) -> str:
    return "accepted" if accepted else f"refused: {reason}"


def merge_table(maps: MapSet, result: MergeResult) -> Table:
    """Each pair's verdict, confidence and transform; a scale from cells to metres, or back, names both."""
    table = plain_table(
        ("pair", False), ("verdict", False), ("confidence", True), ("yaw", True), ("scale", True), ("x, y", True)
    )
    for pair in result.pairs:
        table.add_row(*_merge_row(pair, maps.units[maps.names.index(pair.source)]))
    merged = len(result.reference_from_map)
    table.caption = f"{merged} of {len(maps)} maps merged, frame of {result.reference}"
    if not result.confidence_calibrated:
        table.caption += "; confidence is uncalibrated"
    return table


def _merge_row(pair: PairResult, source_unit: Unit) -> tuple[str, ...]:
    transform = pair.target_from_source
    verdict = _verdict(pair.accepted, pair.reason)
    head = (f"{pair.target} <- {pair.source}", verdict, f"{pair.confidence:.2f}")
    if transform is None:
        return (*head, "-", "-", "-")
    yaw = f"{transform.yaw * 57.29577951308232:.2f} deg"
    mixed = "" if pair.unit == source_unit else f" {pair.unit}/{source_unit}"
    return (*head, yaw, f"{transform.scale:.4f}{mixed}", f"{transform.x:.2f}, {transform.y:.2f} {pair.unit}")


def score_table(score: RunScore) -> Table:
    """Each pair's true overlap, verdict, what that was worth, its candidate's errors and acceptance index."""
    table = plain_table(
        ("pair", False),
        ("true overlap", True),
        ("verdict", False),
        ("outcome", False),
        ("rotation", True),
        ("scale", True),
        ("displacement", True),
        ("acceptance index", True),
    )
    for pair in score.pairs:
        table.add_row(*_score_row(pair))
    counts = score.summary()
    table.caption = (
        f"{counts['right_and_accepted']} of {counts['pairs']} pairs right and accepted, "
        f"{counts['wrong_accepts']} wrongly accepted, {counts['missed']} missed, "
        f"{counts['rightly_refused']} rightly refused"
    )
    return table


def _score_row(pair: PairScore) -> tuple[str, ...]:
    verdict = _verdict(pair.accepted, pair.reason)
    head = (f"{pair.target} <- {pair.source}", f"{100 * pair.overlap:.0f} %", verdict, pair.outcome)
    index = "-" if pair.acceptance_index is None else f"{pair.acceptance_index:.3f}"
    if pair.error is None:
        return (*head, "-", "-", "-", index)
    moved = "no common cells"
    if pair.error.displacement_m is not None:
        moved = f"{pair.error.displacement_m:.3f} m, {pair.error.displacement_cells:.1f} cells"
    return (*head, f"{pair.error.rotation_deg:.2f} deg", f"{pair.error.scale_percent:.2f} %", moved, index)
