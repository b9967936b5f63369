"""Picture of a map on the plans that it fits best."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import Unit
from mapquilt.viz.merge_picture import extent_of, show_walls
from mapquilt.viz.palette import CONFLICT, robot_colour
from mapquilt.viz.panels import Extent, lay_out, write_title
from mapquilt.viz.png import default_style

MOST_PLANS = 4
"""Plans on one picture, the most confident first."""
FAINT = 0.45
"""Opacity of a plan under the walls of the map."""
MARGIN = 0.08
"""Paper around the building that is shown, as a share of its sides."""
LINE = 58
"""Letters of a line below a panel's title."""


@dataclass(frozen=True, eq=False)
class OnPlan:
    """A map on a plan: its ``name``, its ``grey`` picture (H, W), top row first, whose pixels are ``size`` wide in the
    map's unit, the ``building``'s left, right, lower and upper border [pixels, y up], the pose ``plan_from_scan`` in
    the map's unit, what to say, and whether the plan is the one named."""

    name: str
    grey: NDArray[np.uint8]
    size: float
    building: tuple[int, int, int, int]
    plan_from_scan: Similarity2
    text: str
    named: bool


@default_style()
def location_figure(scan: OccupancyGrid, plans: Sequence[OnPlan], unit: Unit) -> Figure:
    """Draw the walls of a map over the pictures of the first plans, in the map's unit: blue on the plan named, red on
    others."""
    if not plans:
        figure, (panel,) = lay_out([extent_of(scan)], units=[unit])
        show_walls(panel, scan, CONFLICT, Similarity2(), zorder=1.0)
        write_title(panel, "the map", "fits none of the plans")
        return figure
    shown = plans[:MOST_PLANS]
    figure, panels = lay_out([_extent(one) for one in shown], units=[unit] * len(shown))
    for panel, one in zip(panels, shown, strict=True):
        rows, cols = one.grey.shape
        panel.imshow(
            one.grey,
            cmap="gray",
            vmin=0,
            vmax=255,
            alpha=FAINT,
            extent=(0.0, cols * one.size, 0.0, rows * one.size),
            interpolation="antialiased",
            aspect="auto",
        )
        show_walls(panel, scan, robot_colour(0) if one.named else CONFLICT, one.plan_from_scan, zorder=2.0)
        write_title(panel, one.name, textwrap.shorten(one.text, LINE, placeholder=" …"))
    return figure


def _extent(one: OnPlan) -> Extent:
    """Return the extent of the building on the plan, and some paper around it."""
    left, right, low, high = (one.size * border for border in one.building)
    wide, tall = MARGIN * (right - left), MARGIN * (high - low)
    return Extent(left - wide, right + wide, low - tall, high + tall)
