"""Common style of charts: plain axes, one colour per method."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

from mapquilt.evaluation.statistics import Interval
from mapquilt.viz.palette import INK, ROBOTS

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

GRID = "#dfe3e8"
MUTED = "#6a737d"
DASHES = ("-", "--", "-.", ":")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
DPI = 120


def series_colour(index: int) -> str:
    return ROBOTS[index % len(ROBOTS)]


def series_marker(index: int) -> str:
    return MARKERS[index % len(MARKERS)]


def series_line(index: int) -> str:
    """Return the dashes of a series, so that curves that coincide can be told apart."""
    return DASHES[index % len(DASHES)]


def series_order(index: int) -> float:
    """Return the height at which a series is drawn: the first lies on top."""
    return 3.0 - 0.01 * index


def whole_numbers(panel: Axes, which: Literal["x", "y"]) -> None:
    """Put the ticks of an axis of counts at whole numbers."""
    from matplotlib.ticker import MaxNLocator

    axis = panel.xaxis if which == "x" else panel.yaxis
    axis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))


def new_figure(columns: int, rows: int = 1, width: float = 4.8, height: float = 3.5) -> tuple[Figure, list[Axes]]:
    """Create a figure with panels of equal size, row by row."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width * columns, height * rows), layout="constrained", dpi=DPI)
    panels = [figure.add_subplot(rows, columns, index + 1) for index in range(rows * columns)]
    for panel in panels:
        quieten(panel)
    return figure, panels


def quieten(panel: Axes) -> None:
    panel.spines[["top", "right"]].set_visible(False)
    panel.spines[["left", "bottom"]].set_color(MUTED)
    panel.tick_params(labelsize=9, colors=INK, color=MUTED, length=3)
    panel.grid(axis="y", color=GRID, linewidth=0.8)
    panel.set_axisbelow(True)


def write_heading(panel: Axes, words: str) -> None:
    panel.set_title(words, fontsize=10.5, loc="left", color=INK, fontweight="bold", parse_math=False)


def write_axes(panel: Axes, x: str, y: str) -> None:
    panel.set_xlabel(x, fontsize=9.5, color=INK, parse_math=False)
    panel.set_ylabel(y, fontsize=9.5, color=INK, parse_math=False)


def write_legend(figure: Figure, handles: Sequence[Artist], names: Sequence[str]) -> None:
    """Write one legend for all panels, above them."""
    figure.legend(
        handles, names, loc="outside upper left", ncols=min(len(names), 8), frameon=False, fontsize=9.5, labelcolor=INK
    )


def draw_series(panel: Axes, points: Sequence[tuple[float, float, Interval | None]], index: int) -> Line2D:
    """Draw a series of places, values and intervals as a line with error bars, and return the line."""
    colour, zorder = series_colour(index), series_order(index)
    for place, value, bar in points:
        if bar is not None:
            reach = [[max(0.0, value - bar.low)], [max(0.0, bar.high - value)]]
            panel.errorbar(
                place, value, yerr=reach, fmt="none", ecolor=colour, elinewidth=1.1, capsize=2.5, zorder=zorder
            )
    x, y = [place for place, *_ in points], [value for _, value, _ in points]
    (line,) = panel.plot(
        x,
        y,
        color=colour,
        linestyle=series_line(index),
        linewidth=1.8,
        marker=series_marker(index),
        markersize=5.0,
        clip_on=False,
        zorder=zorder,
    )
    return line


def in_per_cent(panel: Axes) -> None:
    from matplotlib.ticker import PercentFormatter

    panel.set_ylim(-0.03, 1.03)
    panel.yaxis.set_major_formatter(PercentFormatter(1.0))


def logarithmic(panel: Axes, which: Literal["x", "y"], steps: tuple[float, ...] = (1.0,)) -> None:
    """Make an axis logarithmic, with plain numbers at these steps of each decade."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    panel.set(**{f"{which}scale": "log"})
    axis = panel.xaxis if which == "x" else panel.yaxis
    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
