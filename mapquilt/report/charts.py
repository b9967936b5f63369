"""Charts of every report, drawn from its answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from mapquilt.evaluation.aggregation import error_quantiles
from mapquilt.evaluation.calibration import Calibration, calibration
from mapquilt.evaluation.evaluated_pair import OUTCOMES, EvaluatedPair
from mapquilt.evaluation.formatting import number_text
from mapquilt.evaluation.statistics import Share
from mapquilt.report.content import Chart, methods_of
from mapquilt.viz.palette import INK, OUTCOME_COLOURS
from mapquilt.viz.plot_style import (
    draw_series,
    in_per_cent,
    logarithmic,
    new_figure,
    series_colour,
    series_line,
    series_marker,
    series_order,
    whole_numbers,
    write_axes,
    write_heading,
    write_legend,
)
from mapquilt.viz.png import default_style
from mapquilt.viz.reliability import reliability_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

OVERLAP_BOUNDS = (0.0, 0.15, 0.3, 0.45, 0.6, 0.8, 1.0)
LEAST_FOR_CALIBRATION = 10
Answers = tuple[EvaluatedPair, ...]


def common_charts(answers: Answers, of_study: bool) -> list[Chart]:
    """Draw outcomes, success against noise and overlap, errors, calibration and time, as far as there is data.

    A study has curves of its own for success and time.
    """
    merged = tuple(one for one in answers if one.accepted is not None)
    if not merged:
        return []
    found = [
        _outcomes(merged),
        None if of_study else _against_noise(merged),
        _against_overlap(merged),
        _errors(merged),
        _calibration(merged),
        None if of_study else _time(merged),
    ]
    return [chart for chart in found if chart is not None]


@default_style()
def _outcomes(answers: Answers) -> Chart:
    methods = methods_of(answers)
    figure, (panel,) = new_figure(1, width=8.0, height=0.9 + 0.42 * len(methods))
    texts = []
    for row, method in enumerate(reversed(methods)):
        here: list[str | None] = [one.outcome for one in answers if one.method == method]
        left = 0
        for outcome in OUTCOME_COLOURS:
            count = here.count(outcome)
            panel.barh(row, count, left=left, color=OUTCOME_COLOURS[outcome], height=0.62)
            if count > 0.04 * len(here):
                panel.text(left + count / 2, row, str(count), ha="center", va="center", color="white", fontsize=9)
            left += count
        counts = ", ".join(f"{here.count(outcome)} {outcome}" for outcome in OUTCOMES if here.count(outcome))
        texts.append(f"{method or 'merged'}: {counts}")
    panel.set_yticks(range(len(methods)), list(reversed(methods)))
    panel.grid(visible=False)
    panel.spines[["left"]].set_visible(False)
    panel.tick_params(axis="y", length=0)
    whole_numbers(panel, "x")
    write_axes(panel, "pairs", "")
    _colour_legend(figure, OUTCOME_COLOURS)
    return Chart(
        "Outcomes",
        figure,
        f"Outcomes by method. {'; '.join(reversed(texts))}.",
        "True accept: accepted within 2 degrees, 3 % of scale and 1.5 % of the map's diagonal. False accept: accepted, "
        "but not right. False reject: refused, though there is exactly one right answer. True reject: maps without "
        "common ground, or with several placements that fit.",
    )


def _colour_legend(figure: Figure, colours: Mapping[str, str]) -> None:
    from matplotlib.patches import Patch

    handles = [Patch(facecolor=colour) for colour in colours.values()]
    write_legend(figure, handles, list(colours))


def _against_noise(answers: Answers) -> Chart | None:
    levels = sorted({one.pair.noise for one in answers if one.pair.noise is not None and one.identifiable})
    if len(levels) < 2:
        return None
    classes = [Class(f"{level:g}", float(level), _equal(level)) for level in levels]
    figure, texts = _success(answers, classes, "noise level")
    return Chart(
        "Success against noise",
        figure,
        f"Share of true accepts against the noise level. {texts}.",
        "Of pairs with exactly one right answer; bars are Wilson's 95 % intervals. Noise 1 is an ordinary robot.",
    )


def _against_overlap(answers: Answers) -> Chart | None:
    classes = [
        Class(f"{100 * low:.0f} to {100 * high:.0f} %", (low + high) / 2.0, _between(low, high))
        for low, high in pairwise(OVERLAP_BOUNDS)
    ]
    used = [each for each in classes if any(each.holds(one) and one.identifiable for one in answers)]
    if len(used) < 2:
        return None
    figure, texts = _success(answers, used, "true overlap of the two maps")
    return Chart(
        "Success against overlap",
        figure,
        f"Share of true accepts against the true overlap. {texts}.",
        "Overlap is the area that both robots observed, as a share of the smaller footprint; bars are Wilson's 95 % "
        "intervals.",
    )


@dataclass(frozen=True)
class Class:
    """Answers that share a point on an axis: their name, their place, and their membership test."""

    name: str
    place: float
    holds: Callable[[EvaluatedPair], bool]


def _equal(level: float) -> Callable[[EvaluatedPair], bool]:
    return lambda one: one.pair.noise == level


def _between(low: float, high: float) -> Callable[[EvaluatedPair], bool]:
    return lambda one: one.truth.overlap is not None and low < one.truth.overlap <= high


@default_style()
def _success(answers: Answers, classes: Sequence[Class], axis: str) -> tuple[Figure, str]:
    figure, (panel,) = new_figure(1, width=6.2, height=3.4)
    methods = methods_of(answers)
    handles, texts = [], []
    places = [each.place for each in classes]
    for index, method in enumerate(methods):
        shift = 0.008 * (max(places) - min(places)) * (index - (len(methods) - 1) / 2.0)
        points = []
        for each in classes:
            asked = [one for one in answers if one.method == method and one.identifiable and each.holds(one)]
            if asked:
                share = Share.counted([one.outcome == "true accept" for one in asked])
                points.append((each.place + shift, share.value, share.interval))
                texts.append(f"{method} at {each.name}: {100 * share.value:.0f} % of {share.of}")
        handles.append(draw_series(panel, points, index))
    panel.set_xticks(places, [each.name for each in classes])
    in_per_cent(panel)
    write_axes(panel, axis, "true accepts")
    write_legend(figure, handles, methods)
    return figure, "; ".join(texts)


@default_style()
def _errors(answers: Answers) -> Chart | None:
    parts = [
        ("displacement", "m", "displacement_m", 0.001),
        ("rotation", "degrees", "rotation_deg", 0.01),
        ("scale", "%", "scale_percent", 0.01),
    ]
    methods = methods_of(answers)
    asked = {method: [one for one in answers if one.method == method and one.identifiable] for method in methods}
    accepted = [one for every in asked.values() for one in every if one.accepted]
    if not accepted:
        return None
    figure, panels = new_figure(3, width=2.8, height=3.2)
    handles: dict[str, Line2D] = {}
    for panel, (what, unit, part, least) in zip(panels, parts, strict=True):
        for index, method in enumerate(methods):
            errors = [getattr(one.error, part) for one in accepted if one.method == method and one.error is not None]
            values = sorted(max(least, value) for value in errors if value is not None)
            if values:
                share = np.arange(1, len(values) + 1) / len(asked[method])
                marker = series_marker(index) if len(values) <= 30 else ""
                (handles[method],) = panel.step(
                    values,
                    share,
                    where="post",
                    color=series_colour(index),
                    linestyle=series_line(index),
                    linewidth=1.8,
                    marker=marker,
                    markersize=4,
                    zorder=series_order(index),
                )
        logarithmic(panel, "x")
        in_per_cent(panel)
        write_heading(panel, what)
        write_axes(panel, f"error [{unit}]", "of all pairs" if what == "displacement" else "")
    write_legend(figure, list(handles.values()), list(handles))
    moved = {m: error_quantiles([one for one in accepted if one.method == m])["displacement_m"] for m in methods}
    medians = "; ".join(f"{method}: {found.median:.3f} m" for method, found in moved.items() if found)
    return Chart(
        "Errors, with refusals",
        figure,
        f"Cumulative distributions of the errors, refused pairs counted. Median displacement of accepted: {medians}.",
        "Share of all pairs with exactly one right answer that were accepted with at most that error. A curve ends at "
        "the share that was accepted: what is missing to 100 % was refused.",
    )


def _calibration(answers: Answers) -> Chart | None:
    drawn: list[Calibration] = []
    for method in methods_of(answers):
        found = calibration([one for one in answers if one.method == method])
        if found is not None and found.pairs >= LEAST_FOR_CALIBRATION and not method.endswith("as published"):
            drawn.append(found)
    if not drawn:
        return None
    methods = methods_of(answers)
    figure = reliability_figure(drawn, [methods.index(found.method) for found in drawn])
    texts = [
        f"{found.method}, {found.pairs} answers: Brier {found.brier:.3f}, AUC {number_text(found.auc, 3)}"
        for found in drawn
    ]
    return Chart(
        "Calibration",
        figure,
        f"Share of right answers against confidence in ten bins of equal mass. {'; '.join(texts)}.",
        "A calibrated confidence lies on the dashed line: of answers with confidence 0.8, four in five are right. "
        "Bins of equal mass with Wilson's intervals; distorted pairs are left out.",
    )


@default_style()
def _time(answers: Answers) -> Chart | None:
    timed = [
        (method, seconds)
        for method in methods_of(answers)
        if (seconds := [one.seconds for one in answers if one.method == method and one.seconds is not None])
    ]
    if not timed:
        return None
    figure, (panel,) = new_figure(1, width=6.2, height=1.1 + 0.5 * len(timed))
    for row, (method, seconds) in enumerate(reversed(timed)):
        colour = series_colour(methods_of(answers).index(method))
        drawn = panel.boxplot(
            seconds,
            positions=[row],
            orientation="horizontal",
            widths=0.55,
            whis=(5, 95),
            showfliers=False,
            patch_artist=True,
        )
        drawn["boxes"][0].set(facecolor=colour, edgecolor=colour, alpha=0.35)
        for part in (*drawn["medians"], *drawn["whiskers"], *drawn["caps"]):
            part.set(color=colour, linewidth=1.8)
    panel.set_yticks(range(len(timed)), [method for method, _ in reversed(timed)])
    logarithmic(panel, "x", (1.0, 2.0, 5.0))
    panel.grid(visible=False)
    panel.grid(axis="x", visible=True)
    write_axes(panel, "processor time of a pair [s]", "")
    texts = "; ".join(f"{method}: median {np.median(seconds):.2f} s" for method, seconds in timed)
    return Chart(
        "Time",
        figure,
        f"Processor seconds of a pair by method. {texts}.",
        "On one thread, from two grids in memory to the answer: median, quartiles, 5th and 95th percentile.",
    )


@default_style()
def stage_chart(timings: Mapping[str, Mapping[str, float]]) -> Chart:
    """Draw the wall time of each step of a run."""
    steps = [
        (f"{stage}: {step}".replace("_", " "), seconds)
        for stage, found in timings.items()
        for step, seconds in found.items()
        if step != "total"
    ]
    figure, (panel,) = new_figure(1, width=8.0, height=0.9 + 0.28 * len(steps))
    for row, (_, seconds) in enumerate(reversed(steps)):
        panel.barh(row, seconds, color=series_colour(0), height=0.62)
        panel.text(seconds, row, f" {seconds:.2f} s", va="center", fontsize=8.5, color=INK)
    panel.set_yticks(range(len(steps)), [name for name, _ in reversed(steps)])
    panel.grid(visible=False)
    panel.margins(x=0.12)
    write_axes(panel, "wall time [s]", "")
    texts = "; ".join(f"{name} {seconds:.2f} s" for name, seconds in steps)
    return Chart("Time", figure, f"Seconds of each step. {texts}.", "Wall time of each step that made this run.")
