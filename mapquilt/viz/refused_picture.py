"""Picture of refused pairs: the best candidate, and the runner-up beside it."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.viz.merge_picture import LONGEST_REFERENCE, extent_of, show_grid, show_walls
from mapquilt.viz.palette import INK, robot_colour
from mapquilt.viz.panels import ABOVE, Extent, lay_out, short_name, write_title
from mapquilt.viz.png import default_style
from merge.records.result import MergeResult, PairResult

HEADING = 0.72
"""Height of the reason and the remedy above a row [inches]."""

LINE = 130
"""Letters of a line across both panels."""

MOST_PAIRS = 6
"""Pairs on one picture, the most confident first."""


def pairs_to_show(result: MergeResult) -> tuple[PairResult, ...]:
    """Return the pairs of maps that were not joined which have a candidate, the most confident first."""
    found = [pair for pair in separate_pairs(result) if pair.target_from_source is not None]
    return tuple(sorted(found, key=lambda pair: -pair.confidence)[:MOST_PAIRS])


def separate_pairs(result: MergeResult) -> list[PairResult]:
    """List the pairs of maps that were not joined: those of two groups."""
    group_of = {name: group.reference for group in result.groups for name in group.reference_from_map}
    return [pair for pair in result.pairs if group_of[pair.target] != group_of[pair.source]]


@dataclass(frozen=True, eq=False)
class _Placement:
    """A title, and the source at a place, None if there is none."""

    title: str
    source: OccupancyGrid
    place: Similarity2 | None
    score: float = 0.0


@default_style()
def refused_figure(
    maps: MapSet,
    pairs: Sequence[PairResult],
    remedies: Sequence[str],
    mirrored: Sequence[tuple[OccupancyGrid, PairResult] | None],
) -> Figure:
    """Draw a row for each pair, with the reason and what to try: the source's walls over the target's at the candidate
    and at the runner-up, the better one first, or at the mirrored fit."""
    grid_of = dict(zip(maps.names, maps.grids, strict=True))
    unit_of = dict(zip(maps.names, maps.units, strict=True))
    rows = [
        (pair, places, remedies[index])
        for index, pair in enumerate(pairs)
        for places in [_placements(pair, grid_of[pair.source], mirrored[index])]
    ]
    figure, panels = lay_out(
        [_extent(grid_of[pair.target], one.source, one.place) for pair, places, _ in rows for one in places],
        columns=2,
        units=[unit_of[pair.target] for pair, places, _ in rows for _ in places],
        above=ABOVE + HEADING,
    )
    for row, (pair, places, text) in enumerate(rows):
        for panel, one in zip(panels[2 * row : 2 * row + 2], places, strict=True):
            target = grid_of[pair.target]
            show_grid(panel, target, walls=False)
            show_walls(panel, target, robot_colour(0), Similarity2(), zorder=1.0)
            if one.place is None:
                panel.text(0.5, 0.5, "no other placement was found", transform=panel.transAxes, ha="center", color=INK)
            else:
                show_walls(panel, one.source, robot_colour(1), one.place, zorder=2.0)
            names = [short_name(name, LONGEST_REFERENCE) for name in (pair.source, pair.target)]
            write_title(panel, one.title, f"{names[0]} (orange) on {names[1]} (blue)")
        _write_heading(panels[2 * row], pair, text)
    return figure


def _write_heading(panel: Axes, pair: PairResult, text: str) -> None:
    """Write the reason of the refusal and the remedy above both panels of a row."""
    lines = (*textwrap.wrap(f"Refused: {pair.reason_text}", LINE)[:1], *textwrap.wrap(f"Try: {text}", LINE)[:3])
    panel.annotate(
        "\n".join(lines),
        (0.0, 1.0),
        (0.0, 34.0),
        "axes fraction",
        "offset points",
        fontsize=9,
        color=INK,
        parse_math=False,
        annotation_clip=False,
    )


def _placements(
    pair: PairResult, source: OccupancyGrid, mirrored: tuple[OccupancyGrid, PairResult] | None
) -> list[_Placement]:
    """Return the candidate and the runner-up, or the mirrored fit, the one with the higher score first."""
    score = 0.0 if pair.evidence is None else pair.evidence.score
    title = "candidate" if pair.evidence is None else f"candidate, score {score:.2f}"
    places = [_Placement(title, source, pair.target_from_source, score)]
    if mirrored is not None and mirrored[1].target_from_source is not None:
        grid, fit = mirrored
        score = 0.0 if fit.evidence is None else fit.evidence.score
        places.append(_Placement(f"{pair.source} mirrored, score {score:.2f}", grid, fit.target_from_source, score))
    elif pair.alternatives:
        other = pair.alternatives[0]
        places.append(_Placement(f"elsewhere, score {other.score:.2f}", source, other.target_from_source, other.score))
    else:
        places.append(_Placement("no runner-up", source, None, -1.0))
    return sorted(places, key=lambda one: -one.score)


def _extent(target: OccupancyGrid, source: OccupancyGrid, target_from_source: Similarity2 | None) -> Extent:
    own = extent_of(target)
    if target_from_source is None:
        return own
    other = extent_of(source)
    corners = [(x, y) for x in (other.left, other.right) for y in (other.low, other.high)]
    (left, low), (right, high) = (
        extreme(target_from_source.apply(np.array(corners)), axis=0) for extreme in (np.min, np.max)
    )
    return Extent(min(own.left, left), max(own.right, right), min(own.low, low), max(own.high, high))
