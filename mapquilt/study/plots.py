"""Curves of a study, each with its intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mapping.numbers import parse_number, parse_range
from mapquilt.evaluation.statistics import Interval, Quantiles
from mapquilt.study.results import Cell, Mean, StudyResults
from mapquilt.viz.plot_style import (
    draw_series,
    in_per_cent,
    logarithmic,
    new_figure,
    series_colour,
    write_axes,
    write_heading,
    write_legend,
)
from mapquilt.viz.png import default_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

LOGARITHMIC = 8.0
"""Ratio of the last to the first value from which the axis is logarithmic."""
DODGE = 0.012
"""Distance between the points of two methods, as a share of the axis."""


@dataclass(frozen=True)
class Point:
    """A value with a thin interval and a wide one."""

    value: float
    bar: Interval | None = None
    band: Interval | None = None


OfCell = Callable[[Cell], Point | None]


@dataclass(frozen=True)
class Axis:
    """Places and labels of the values of the first varied setting."""

    places: tuple[float, ...]
    labels: tuple[str, ...]
    logarithmic: bool

    @staticmethod
    def of(values: Sequence[str]) -> Axis:
        numbers = [_number(value) for value in values]
        known = [number for number in numbers if number is not None]
        if len(known) < len(values) or sorted(known) != known or ":" in values[0]:
            return Axis(tuple(map(float, range(len(values)))), tuple(values), False)
        logarithmic = known[0] > 0.0 and known[-1] / known[0] >= LOGARITHMIC
        return Axis(tuple(known), tuple(values), logarithmic)

    def dodged(self, index: int, count: int) -> list[float]:
        shift = DODGE * (index - (count - 1) / 2.0)
        if self.logarithmic:
            width = math.log(self.places[-1] / self.places[0])
            return [place * math.exp(shift * width) for place in self.places]
        return [place + shift * (max(self.places) - min(self.places)) for place in self.places]

    def prepare(self, panel: Axes) -> None:
        if self.logarithmic:
            panel.set_xscale("log")
        panel.set_xticks(self.places, self.labels)
        panel.minorticks_off()
        if len(self.labels) * max(map(len, self.labels)) > 50:
            panel.tick_params(axis="x", rotation=30)


def _number(text: str) -> float | None:
    try:
        return sum(parse_range(text)) / 2.0 if ":" in text else parse_number(text)
    except ValueError:
        return None


def study_figures(results: StudyResults) -> Mapping[str, Figure]:
    """Draw all figures, by the name of their file; the first is the main one."""
    return {
        "success": success_figure(results),
        "errors": errors_figure(results),
        "quality": quality_figure(results),
        "time": time_figure(results),
    }


@default_style()
def success_figure(results: StudyResults) -> Figure:
    """Draw the shares of true and of false accepts, in a row for each value of the second setting if there is one."""
    columns: list[tuple[str, OfCell]] = [
        ("true accepts", _true_accepts),
        ("false accepts: the fewer the better", _false_accepts),
    ]
    figure = _grid(results, columns, ("of pairs with one right answer", "of all pairs"))
    for panel in figure.axes:
        in_per_cent(panel)
    for panel in figure.axes[1::2]:
        panel.set_ylim(-0.01, max(0.105, min(1.03, panel.dataLim.y1 * 1.05)))
    return figure


@default_style()
def errors_figure(results: StudyResults) -> Figure:
    """Draw median and 90th percentile of the errors of accepted answers."""
    columns: list[tuple[str, OfCell]] = [
        ("displacement", lambda cell: _up_to_p90(cell.pairs.errors_accepted["displacement_m"])),
        ("rotation", lambda cell: _up_to_p90(cell.pairs.errors_accepted["rotation_deg"])),
        ("scale", lambda cell: _up_to_p90(cell.pairs.errors_accepted["scale_percent"])),
    ]
    figure = _grid(results, columns, ("median to 90th percentile [m]", "[degrees]", "[%]"))
    for panel in figure.axes:
        panel.set_yscale("symlog", linthresh=0.01)
        panel.yaxis.set_major_formatter("{x:g}")
        panel.set_ylim(bottom=0.0)
    return figure


@default_style()
def quality_figure(results: StudyResults) -> Figure:
    """Draw the quality of the merged map against all that the team observed, and the acceptance index."""
    columns: list[tuple[str, OfCell]] = [
        ("free space of the merged map", lambda cell: _mean(cell.iou_free)),
        ("walls of the merged map", lambda cell: _mean(cell.f1_walls)),
        ("acceptance index of the answers", _index),
    ]
    figure = _grid(results, columns, ("intersection over union", "F1 within 0.1 m", "median"))
    for panel in figure.axes:
        panel.set_ylim(-0.03, 1.03)
    return figure


@default_style()
def time_figure(results: StudyResults) -> Figure:
    """Draw the processor time of a pair: median, 10th and 90th percentile over missions."""
    times = {(time.level, time.method): time for time in results.times}

    def of(cell: Cell) -> Point | None:
        time = times.get((cell.level, cell.method))
        return None if time is None else Point(time.median_s, Interval(time.p10_s, time.p90_s))

    figure = _grid(results, [("processor time of a pair", of)], ("median, 10th to 90th percentile [s]",))
    for panel in figure.axes:
        logarithmic(panel, "y", (1.0, 2.0, 5.0))
    return figure


def _true_accepts(cell: Cell) -> Point | None:
    share = cell.pairs.true_accepts
    band = cell.pairs.clustered.get("true_accepts")
    return None if share is None else Point(share.value, share.interval, band)


def _false_accepts(cell: Cell) -> Point | None:
    share = cell.pairs.false_accepts
    return None if share is None else Point(share.value, share.interval)


def _mean(mean: Mean | None) -> Point | None:
    return None if mean is None else Point(mean.value, mean.interval)


def _index(cell: Cell) -> Point | None:
    return None if cell.pairs.acceptance_index is None else Point(cell.pairs.acceptance_index)


def _up_to_p90(errors: Quantiles | None) -> Point | None:
    return None if errors is None else Point(errors.median, Interval(errors.median, errors.p90))


def _grid(results: StudyResults, columns: Sequence[tuple[str, OfCell]], units: Sequence[str]) -> Figure:
    """Draw a column for each quantity and a row for each value of the second setting."""
    varied = results.plan.varied
    second = varied[1].values if len(varied) > 1 else (None,)
    axis = Axis.of(varied[0].values)
    figure, panels = new_figure(len(columns), len(second), width=5.2 if len(columns) > 1 else 6.4, height=3.4)
    handles: list[Line2D] = []
    for row, value in enumerate(second):
        for column, (title, of) in enumerate(columns):
            panel = panels[row * len(columns) + column]
            handles = _draw(panel, results, axis, value, of)
            axis.prepare(panel)
            write_heading(panel, title if value is None else f"{title}: {varied[1].variable.name} {value}")
            write_axes(panel, varied[0].variable.axis, units[column])
    write_legend(figure, handles, [method.title for method in results.plan.methods])
    return figure


def _draw(panel: Axes, results: StudyResults, axis: Axis, second: str | None, of: OfCell) -> list[Line2D]:
    methods = [method.title for method in results.plan.methods]
    handles = []
    for index, method in enumerate(methods):
        levels = [(value,) if second is None else (value, second) for value in results.plan.varied[0].values]
        points = [of(results.cell(level, method)) for level in levels]
        places = axis.dodged(index, len(methods))
        known = [(place, point) for place, point in zip(places, points, strict=True) if point is not None]
        handles.append(_draw_series(panel, known, index))
    return handles


def _draw_series(panel: Axes, known: Sequence[tuple[float, Point]], index: int) -> Line2D:
    banded = [(place, point.band) for place, point in known if point.band is not None]
    if banded:
        low, high = [band.low for _, band in banded], [band.high for _, band in banded]
        colour = series_colour(index)
        panel.fill_between([place for place, _ in banded], low, high, color=colour, alpha=0.13, linewidth=0.0)
    return draw_series(panel, [(place, point.value, point.bar) for place, point in known], index)
