"""Picture of bent maps: the deformed control grid of each, over the merged map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.viz.merge_picture import extent_of, show_grid
from mapquilt.viz.palette import INK, map_colours
from mapquilt.viz.panels import lay_out, write_title
from mapquilt.viz.png import default_style
from merge.records.bent_map import BentMap
from merge.records.result import MergedGroup


@default_style()
def elastic_figure(maps: MapSet, groups: Sequence[MergedGroup]) -> Figure:
    """Draw each bent map's control grid as it was deformed, in the map's colour, and how its nodes moved, to scale."""
    shown = [(group, name, bent) for group in groups for name, bent in group.bends.items()]
    figure, panels = lay_out(
        [extent_of(group.merged) for group, _, _ in shown],
        units=[maps.units[maps.names.index(group.reference)] for group, _, _ in shown],
    )
    colours = dict(zip(maps.names, map_colours(maps.names), strict=True))
    for panel, (group, name, bent) in zip(panels, shown, strict=False):
        index = maps.names.index(name)
        show_grid(panel, group.merged)
        _show_bend(panel, maps.grids[index], bent, group.reference_from_map[name], colours[name])
        unit = "cells" if maps.units[index] == "cell" else "m"
        first = ", straightened first" if bent.straightened else ""
        write_title(
            panel,
            name,
            f"bent by up to {bent.largest_bend:.2f} {unit}, strain {100.0 * bent.strain:.1f} %{first}",
            colours[name],
        )
    return figure


def _show_bend(panel: Axes, grid: OccupancyGrid, bent: BentMap, reference_from_map: Similarity2, colour: str) -> None:
    """Draw the elements that hold known cells, and a dark line from the undeformed to the deformed place of nodes."""
    bend = bent.bend
    rows, cols, _ = bend.nodes.shape
    place = reference_from_map @ Similarity2.from_se2(grid.frame.origin, grid.frame.resolution)
    row, col = np.indices((rows, cols))
    cells = bend.corner + bend.spacing * np.stack((col, row), axis=-1)
    before = place.apply(cells.reshape(-1, 2)).reshape(rows, cols, 2)
    after = place.apply((cells + bend.nodes).reshape(-1, 2)).reshape(rows, cols, 2)
    known = np.argwhere(grid.known) + 0.5
    counts, _, _ = np.histogram2d(
        known[:, 0],
        known[:, 1],
        bins=(
            bend.corner[1] + bend.spacing * np.arange(rows),
            bend.corner[0] + bend.spacing * np.arange(cols),
        ),
    )
    used = np.pad(counts > 0, 1)
    along_x, along_y = used[1:, 1:-1] | used[:-1, 1:-1], used[1:-1, 1:] | used[1:-1, :-1]
    edges = [
        *np.stack((after[:, :-1], after[:, 1:]), axis=2)[along_x],
        *np.stack((after[:-1], after[1:]), axis=2)[along_y],
    ]
    nodes = used[1:, 1:] | used[1:, :-1] | used[:-1, 1:] | used[:-1, :-1]
    moves = list(np.stack((before, after), axis=2)[nodes])
    panel.add_collection(LineCollection(edges, colors=colour, linewidths=0.6, alpha=0.8, zorder=2.0))
    panel.add_collection(LineCollection(moves, colors=INK, linewidths=0.9, zorder=3.0))
    panel.plot(*after[nodes].T, ".", color=colour, markersize=2.5, zorder=4.0)
