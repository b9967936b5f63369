"""Pictures of maps of logs, with the path, the keyframes and the loops."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.wording import counted
from mapquilt.viz.merge_picture import extent_of, show_grid
from mapquilt.viz.palette import FENCE, INK, map_colours, robot_colour
from mapquilt.viz.panels import ABOVE, BELOW, LEFT, RIGHT, Extent, label_axes, lay_out, write_title
from mapquilt.viz.png import default_style

LONGER_SIDE = 8.0
"""Longer side of the map on the sheet [inches]."""
NARROWEST = 7.2
"""Least width of the map on the sheet [inches], for title and legend."""
LEGEND = 0.35
"""Height of the legend below the map [inches]."""
REFERENCE = "#8b949e"


@default_style()
def log_map_figure(
    name: str,
    details: str,
    grid: OccupancyGrid,
    path: NDArray[np.float64],
    keyframes: NDArray[np.int64],
    loops: Sequence[tuple[int, int]],
    reference: NDArray[np.float64] | None = None,
) -> Figure:
    """Draw a map [m] and in its frame the path (N, 2), the scans that are ``keyframes``, a line for each loop between
    two scans, and a ``reference`` path (N, 2)."""
    extent = _extent(grid, path).with_margin()
    width, height = extent.right - extent.left, extent.high - extent.low
    scale = LONGER_SIDE / max(width, height)
    shown = extent.widened_to(max(width * scale, NARROWEST) / (height * scale))
    size = (shown.right - shown.left) * scale, (shown.high - shown.low) * scale
    figure = Figure(figsize=(LEFT + size[0] + RIGHT, ABOVE + size[1] + BELOW + LEGEND), dpi=110)
    across, up = figure.get_size_inches()
    panel = figure.add_axes((LEFT / across, (BELOW + LEGEND) / up, size[0] / across, size[1] / up))
    panel.set(xlim=(shown.left, shown.right), ylim=(shown.low, shown.high))
    panel.set_autoscale_on(False)
    show_grid(panel, grid)
    if reference is not None:
        panel.plot(*reference.T, color=REFERENCE, linewidth=1.6, linestyle=(0, (2, 1)), label="reference")
    colour = robot_colour(0)
    panel.plot(*path.T, color=colour, linewidth=1.0, label="path")
    if keyframes.size:
        panel.plot(*path[keyframes].T, ".", color=colour, markersize=2.5, label=counted(keyframes.size, "keyframe"))
    if loops:
        lines = [path[list(pair)] for pair in loops]
        panel.add_collection(LineCollection(lines, colors=FENCE, linewidths=0.8, label=counted(len(loops), "loop")))
    panel.plot(*path[0], "o", color=colour, markersize=6, markeredgecolor="white", label="start")
    panel.plot(*path[-1], "s", color=colour, markersize=5, markeredgecolor="white", label="end")
    panel.tick_params(labelsize=7, colors=INK, length=2)
    label_axes(panel, "m")
    for spine in panel.spines.values():
        spine.set_color("#d0d4d9")
    panel.legend(
        fontsize=8, loc="upper left", bbox_to_anchor=(0.0, -BELOW / size[1]), frameon=False, ncols=6, borderaxespad=0.0
    )
    write_title(panel, name, details)
    return figure


def log_maps_figure(
    names: Sequence[str], grids: Sequence[OccupancyGrid], paths: Sequence[NDArray[np.float64]]
) -> Figure:
    """Draw several maps beside one another, each in its own frame [m] with its path (N, 2)."""
    figure, panels = lay_out([_extent(grid, path) for grid, path in zip(grids, paths, strict=True)])
    for panel, name, grid, path, colour in zip(panels, names, grids, paths, map_colours(names), strict=True):
        show_grid(panel, grid)
        panel.plot(*path.T, color=colour, linewidth=1.0)
        panel.plot(*path[0], "o", color=colour, markersize=5, markeredgecolor="white")
        length = float(np.hypot(*np.diff(path, axis=0).T).sum())
        write_title(panel, name, f"{length:.0f} m driven, start as a dot", colour)
    return figure


def _extent(grid: OccupancyGrid, path: NDArray[np.float64]) -> Extent:
    known = extent_of(grid)
    (left, low), (right, high) = path.min(axis=0), path.max(axis=0)
    return Extent(min(known.left, left), max(known.right, right), min(known.low, low), max(known.high, high))
