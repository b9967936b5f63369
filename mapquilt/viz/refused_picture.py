"""Picture of refused pairs: the best candidate, and the runner-up beside it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.viz.merge_picture import extent_of, show_grid, show_walls
from mapquilt.viz.palette import INK, robot_colour
from mapquilt.viz.panels import Extent, lay_out, write_title
from mapquilt.viz.png import default_style
from merge.records.result import MergeResult, PairResult

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


@default_style()
def refused_figure(maps: MapSet, pairs: Sequence[PairResult]) -> Figure:
    """Draw a row for each pair: the source's walls over the target's at the candidate, and at the runner-up."""
    grid_of = dict(zip(maps.names, maps.grids, strict=True))
    rows = [(pair, place) for pair in pairs for place in _placements(pair)]
    extents = [_extent(grid_of[pair.target], grid_of[pair.source], place) for pair, (_, place) in rows]
    figure, panels = lay_out(extents, columns=2)
    for panel, (pair, (title, place)) in zip(panels, rows, strict=True):
        target, source = grid_of[pair.target], grid_of[pair.source]
        show_grid(panel, target, walls=False)
        show_walls(panel, target, robot_colour(0), Similarity2(), zorder=1.0)
        if place is None:
            panel.text(0.5, 0.5, "no other placement was found", transform=panel.transAxes, ha="center", color=INK)
        else:
            show_walls(panel, source, robot_colour(1), place, zorder=2.0)
        write_title(panel, title, f"{pair.source} (orange) on {pair.target} (blue)")
    return figure


def _placements(pair: PairResult) -> tuple[tuple[str, Similarity2 | None], tuple[str, Similarity2 | None]]:
    """Return the candidate and the runner-up, each with its title."""
    candidate = "candidate" if pair.evidence is None else f"candidate, score {pair.evidence.score:.2f}"
    if not pair.alternatives:
        return (candidate, pair.target_from_source), ("no runner-up", None)
    other = pair.alternatives[0]
    return (candidate, pair.target_from_source), (f"runner-up, score {other.score:.2f}", other.target_from_source)


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
