"""Print short tables on the terminal."""

from __future__ import annotations

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from mapping.geometry.similarity2 import Similarity2
from mapping.io.safe_load import printable
from mapping.map_set import MapSet, Unit
from mapping.wording import counted, fixed, merged_count
from mapquilt.viz.text_table import plain_table
from merge.records.result import MergedGroup, MergeResult, PairResult

PLAIN_WIDTH = 80
"""Columns if the output is not a terminal."""

LEAST_CONTRADICTION = 0.03
"""Share of contradicting walls that is worth a note."""

LEAST_DOUBLED = 0.01
"""Share of doubled walls that is worth a warning."""


def print_table(table: Table | str) -> None:
    """Print on standard output; in colour only on a terminal. Brackets in names are not markup."""
    width = None if Console().is_terminal else PLAIN_WIDTH
    console = Console(highlight=False, markup=False, emoji=False, width=width)
    console.print(printable(table) if isinstance(table, str) else table, soft_wrap=isinstance(table, str))


def warn(warnings: tuple[str, ...]) -> None:
    """Print warnings on standard error, one line each."""
    for warning in warnings:
        typer.echo(f"mapquilt: warning: {printable(warning)}", err=True)


def merge_table(maps: MapSet, result: MergeResult, alternatives: bool = False) -> Table:
    """Tabulate each pair's verdict, confidence and transform, with one standard deviation, in 80 columns.

    Reasons are listed below. A scale between cells and metres names both units. ``alternatives`` adds a row for each
    other placement, with its score against that of the answer.
    """
    table = plain_table(
        ("pair", False), ("verdict", False), ("confidence", True), ("yaw [rad]", True), ("scale", True), ("x, y", True)
    )
    notes = []
    for pair in result.pairs:
        name, source_unit = f"{pair.target} <- {pair.source}", maps.units[maps.names.index(pair.source)]
        verdict = ("accepted" if pair.verified else "unverified") if pair.accepted else "refused"
        confidence = f"{pair.confidence:.2f}" if pair.verified else "-"
        place = _place(pair, source_unit, pair.target_from_source, pair.covariance)
        table.add_row(name, verdict, confidence, *place)
        notes += [f"{name}: {text}" for text in _note(pair)]
        for other in pair.alternatives if alternatives else ():
            place = _place(pair, source_unit, other.target_from_source, None)
            table.add_row("  or elsewhere", f"score {other.score:.2f}", "", *place)
        if alternatives and pair.alternatives and pair.evidence is not None:
            notes.append(f"{name}: score {pair.evidence.score:.2f}, against those of the other places")
    summary = f"{merged_count(len(result.reference_from_map), len(maps))}, frame of {result.reference}"
    for group in result.groups[1:]:
        if len(group.reference_from_map) > 1:
            summary += f"; {len(group.reference_from_map)} more, frame of {group.reference}"
    notes += [text for group in result.groups for text in _bends(maps, group)]
    if not result.confidence_calibrated:
        summary += "; confidence is uncalibrated"
    table.caption = "\n".join((*notes, summary))
    return table


def _bends(maps: MapSet, group: MergedGroup) -> tuple[str, ...]:
    """Name the largest bend of each map of a group; or say that elastic merging gained nothing."""
    if group.rigid_conflict_cells is None:
        return ()
    if not group.bends:
        return (f"{', '.join(group.reference_from_map)}: not bent, because bending brings no walls together",)
    bent = [
        f"{name}: bent by up to {bend.largest_bend:.2f} {_plural(maps.units[maps.names.index(name)])}, strain "
        f"{100.0 * bend.strain:.1f} %{', straightened' if bend.straightened else ''}"
        for name, bend in group.bends.items()
    ]
    return (*bent, f"cells in conflict: {group.conflict_cells}; {group.rigid_conflict_cells} without bends")


def doubled_walls(result: MergeResult, written: bool) -> tuple[str, ...]:
    """Warn of each merged map that shows at least 1 % of the common walls of its maps more than once."""
    return tuple(
        f"the merged map of {', '.join(group.reference_from_map)} shows {100.0 * group.doubled_walls:.0f} % of their "
        f"common walls twice, because the maps lie apart there{': see merge.png, in red' if written else ''}"
        for group in result.groups
        if group.doubled_walls >= LEAST_DOUBLED
    )


def _note(pair: PairResult) -> tuple[str, ...]:
    """Return the reason of a refusal, or who accepted a pair that was not accepted by itself, and what contradicts."""
    against = _contradiction(pair)
    if pair.remark is not None:
        return (f"refused: {pair.remark}" if not pair.accepted else pair.remark, *against)
    if pair.decided_by == "pair":
        return against
    alone = f", alone refused: {pair.pair_refusal}" if pair.pair_refusal else ""
    return (f"accepted by the {'team' if pair.decided_by == 'team' else 'start poses'}{alone}", *against)


def _contradiction(pair: PairResult) -> tuple[str, ...]:
    """Name the walls in the free space of the other map, if they are worth a note."""
    evidence = pair.evidence
    violation = 0.0 if evidence is None else evidence.local_violation or 0.0
    if evidence is None or violation < LEAST_CONTRADICTION:
        return ()
    cells = round(evidence.conflict_cells or 0.0)
    pieces = f", {counted(cells, 'cell')} of them in long pieces" if cells else ""
    return (f"{100.0 * violation:.0f} % of the common walls lie in free space{pieces}",)


def _place(
    pair: PairResult, source_unit: Unit, transform: Similarity2 | None, covariance: NDArray[np.float64] | None
) -> tuple[str, str, str]:
    """Format yaw, scale and translation, each above its standard deviation."""
    if transform is None:
        return "-", "-", "-"
    x, y, yaw, scale = _deviations(covariance)
    mixed = "" if pair.unit == source_unit else f"\n{pair.unit}/{source_unit}"
    return (
        f"{fixed(transform.yaw, 4)}{yaw}",
        f"{transform.scale:.4f}{scale}{mixed}",
        f"{fixed(transform.x, 2)}, {fixed(transform.y, 2)} {_plural(pair.unit)}{x}{y}",
    )


def _plural(unit: Unit) -> str:
    return "cells" if unit == "cell" else unit


def _deviations(covariance: NDArray[np.float64] | None) -> tuple[str, str, str, str]:
    if covariance is None:
        return "", "", "", ""
    x, y, yaw, scale = np.sqrt(np.diag(covariance)).tolist()
    scale_text = f"\n± {scale:.4f}" if scale > 0.0 else ""
    return f"\n± {x:.2f}", f", {y:.2f}", f"\n± {yaw:.4f}", scale_text
