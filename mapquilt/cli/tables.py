"""Print short tables on the terminal."""

from __future__ import annotations

import math

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet, Unit
from mapquilt.viz.text_table import plain_table
from merge.records.result import MergeResult, PairResult

PLAIN_WIDTH = 160
"""Columns if the output is not a terminal, so that rows do not break."""


def print_table(table: Table | str) -> None:
    """Print on standard output; in colour only on a terminal. Brackets in names are not markup."""
    width = None if Console().is_terminal else PLAIN_WIDTH
    console = Console(highlight=False, markup=False, emoji=False, width=width)
    console.print(table, soft_wrap=isinstance(table, str))


def warn(warnings: tuple[str, ...]) -> None:
    """Print warnings on standard error, one line each."""
    for warning in warnings:
        typer.echo(f"mapquilt: warning: {warning}", err=True)


def count_of_maps(number: int) -> str:
    """Write a number of maps, such as ``3 maps``."""
    return f"{number} map" if number == 1 else f"{number} maps"


def _verdict(accepted: bool, reason: str | None) -> str:
    return "accepted" if accepted else f"refused: {reason}"


def merge_table(maps: MapSet, result: MergeResult, alternatives: bool = False) -> Table:
    """Tabulate each pair's verdict, confidence and transform, with one standard deviation.

    A scale between cells and metres names both units. ``alternatives`` adds a row for each other placement.
    """
    table = plain_table(
        ("pair", False), ("verdict", False), ("confidence", True), ("yaw", True), ("scale", True), ("x, y", True)
    )
    for pair in result.pairs:
        source_unit = maps.units[maps.names.index(pair.source)]
        head = (f"{pair.target} <- {pair.source}", _verdict_of(pair), f"{pair.confidence:.2f}")
        table.add_row(*head, *_place(pair, source_unit, pair.target_from_source, pair.covariance))
        for other in pair.alternatives if alternatives else ():
            place = _place(pair, source_unit, other.target_from_source, None)
            table.add_row("", f"or elsewhere: walls agree {other.score:.2f}{_against(pair)}", "", *place)
    merged = len(result.reference_from_map)
    table.caption = f"{merged} of {len(maps)} maps merged, frame of {result.reference}"
    for group in result.groups[1:]:
        if len(group.reference_from_map) > 1:
            table.caption += f"; {len(group.reference_from_map)} more, frame of {group.reference}"
    if not result.confidence_calibrated:
        table.caption += "; confidence is uncalibrated"
    return table


def _verdict_of(pair: PairResult) -> str:
    if pair.accepted and pair.decided_by != "pair":
        alone = f", alone refused: {pair.pair_refusal}" if pair.pair_refusal else ""
        return f"accepted by the {'team' if pair.decided_by == 'team' else 'start poses'}{alone}"
    return _verdict(pair.accepted, pair.reason_text)


def _against(pair: PairResult) -> str:
    return "" if pair.evidence is None else f", not {pair.evidence.score:.2f}"


def _place(
    pair: PairResult, source_unit: Unit, transform: Similarity2 | None, covariance: NDArray[np.float64] | None
) -> tuple[str, str, str]:
    if transform is None:
        return "-", "-", "-"
    x, y, yaw, scale = _deviations(covariance)
    mixed = "" if pair.unit == source_unit else f" {pair.unit}/{source_unit}"
    return (
        f"{math.degrees(transform.yaw):.2f}{yaw} deg",
        f"{transform.scale:.4f}{scale}{mixed}",
        f"{transform.x:.2f}{x}, {transform.y:.2f}{y} {pair.unit}",
    )


def _deviations(covariance: NDArray[np.float64] | None) -> tuple[str, str, str, str]:
    if covariance is None:
        return "", "", "", ""
    x, y, yaw, scale = np.sqrt(np.diag(covariance)).tolist()
    return f" ± {x:.2f}", f" ± {y:.2f}", f" ± {math.degrees(yaw):.2f}", f" ± {scale:.4f}" if scale > 0.0 else ""
