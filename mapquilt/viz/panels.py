"""Layout of panels of equal size, each with a title and axes in its own metres or cells."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mapping.map_set import Unit
from mapquilt.viz.palette import FREE, INK, of_255
from mapquilt.viz.png import default_style

WIDTH = 4.6
"""Width of a panel [inches]."""
LEFT, RIGHT, ABOVE, BELOW = 0.56, 0.13, 0.50, 0.42
"""Margins of a panel for ticks, labels and titles [inches]."""
SQUATTEST, TALLEST = 1.6, 0.8
"""Least and greatest ratio of width to height of a panel."""
MARGIN = 0.02
"""Margin around the content, as a share of its longer side."""
LONGEST_NAME = 40
"""Number of letters of a title that fit the width of a panel."""


@dataclass(frozen=True)
class Extent:
    """Bounds of the content of a panel [m]."""

    left: float
    right: float
    low: float
    high: float

    def with_margin(self) -> Extent:
        margin = MARGIN * max(self.right - self.left, self.high - self.low)
        return Extent(self.left - margin, self.right + margin, self.low - margin, self.high + margin)

    @property
    def aspect(self) -> float:
        return (self.right - self.left) / (self.high - self.low)

    def widened_to(self, aspect: float) -> Extent:
        """Return the smallest extent of that ratio of width to height around the same centre."""
        width = max(self.right - self.left, aspect * (self.high - self.low))
        x, y = (self.left + self.right) / 2.0, (self.low + self.high) / 2.0
        height = width / aspect
        return Extent(x - width / 2.0, x + width / 2.0, y - height / 2.0, y + height / 2.0)


@default_style()
def lay_out(
    extents: Sequence[Extent],
    legend_inches: float = 0.0,
    columns: int | None = None,
    units: Sequence[Unit] | None = None,
    above: float = ABOVE,
) -> tuple[Figure, list[Axes]]:
    """Create a figure with a panel for each extent, equally scaled in x and y; the last row is centred.

    ``legend_inches`` is left free below the first row. ``columns`` defaults to as many as leave few gaps. ``units`` are
    those of the panels, by default metres. ``above`` is the margin for titles [inches].
    """
    shown = [extent.with_margin() for extent in extents]
    aspect = math.exp(sum(math.log(extent.aspect) for extent in shown) / len(shown))
    aspect = min(max(aspect, TALLEST), SQUATTEST)
    columns = columns or _columns(len(shown))
    rows = math.ceil(len(shown) / columns)
    step_x, step_y = LEFT + WIDTH + RIGHT, above + WIDTH / aspect + BELOW
    size = (step_x * columns, step_y * rows + legend_inches)
    figure = Figure(figsize=size, dpi=110)
    panels = []
    for index, extent in enumerate(shown):
        row, column = divmod(index, columns)
        in_row = min(columns, len(shown) - row * columns)
        x = step_x * (column + (columns - in_row) / 2.0) + LEFT
        y = size[1] - step_y * (row + 1) + BELOW - (legend_inches if row else 0.0)
        box = (x / size[0], y / size[1], WIDTH / size[0], WIDTH / aspect / size[1])
        panels.append(_panel(figure, box, extent.widened_to(aspect)))
        label_axes(panels[-1], "m" if units is None else units[index])
    return figure, panels


def _columns(count: int) -> int:
    # Few gaps; two rows of two read better than three panels and one.
    if count <= 4:
        return 2 if count == 4 else count
    return min((3, 4), key=lambda columns: (-count % columns, columns))


def _panel(figure: Figure, box: tuple[float, float, float, float], shown: Extent) -> Axes:
    panel = figure.add_axes(box)
    panel.set(xlim=(shown.left, shown.right), ylim=(shown.low, shown.high), facecolor=of_255(FREE))
    panel.set_autoscale_on(False)
    panel.tick_params(labelsize=7, colors=INK, length=2)
    for spine in panel.spines.values():
        spine.set_color("#d0d4d9")
    return panel


def label_axes(panel: Axes, unit: Unit) -> None:
    """Write the unit of a map's axes at their ends."""
    name = "cells" if unit == "cell" else unit
    panel.set_xlabel(f"x [{name}]", fontsize=7, color=INK, loc="right", labelpad=1.0)
    panel.set_ylabel(f"y [{name}]", fontsize=7, color=INK, loc="top", labelpad=1.0)


def short_name(name: str, most: int = LONGEST_NAME) -> str:
    """Keep the end of a name that is too long."""
    return name if len(name) <= most else "…" + name[1 - most :]


def write_title(panel: Axes, name: str, details: str = "", colour: str = INK) -> None:
    """Write a name, of which the end is kept if it is too long, with details below."""
    panel.set_title(
        short_name(name), fontsize=10, fontweight="bold", color=colour, loc="left", pad=17.0, parse_math=False
    )
    panel.annotate(
        details, (0.0, 1.0), (0.0, 5.0), "axes fraction", "offset points", fontsize=8, color=INK, parse_math=False
    )
