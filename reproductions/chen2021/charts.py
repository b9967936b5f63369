"""Plots of the shares of right answers: by case beside the thesis's, and of the ablation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mapquilt.viz.palette import INK, ROBOTS
from mapquilt.viz.plot_style import (
    DPI,
    MARKERS,
    MUTED,
    in_per_cent,
    new_figure,
    quieten,
    write_axes,
    write_heading,
    write_legend,
)
from mapquilt.viz.png import default_style
from reproductions.chen2021.cases import (
    CASES,
    FACTORS,
    FULL,
    HALL_CASES,
    HIGH_LEVEL,
    LEVELS,
    LOW_LEVEL,
    SETS,
    WHOLE,
    Case,
    factor_name,
    plane_name,
)
from reproductions.chen2021.methods import CORRECTED, ORB, OURS, PARTS, PLAIN, without
from reproductions.chen2021.tally import Tallies, Tally

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {PLAIN: ROBOTS[0], ORB: ROBOTS[3], CORRECTED: ROBOTS[1], OURS: ROBOTS[2]}
SHOWN = {PLAIN: "SIFT", ORB: "ORB", CORRECTED: "the correction", OURS: "quilt"}
"""Names of the methods in legends."""


@default_style()
def cases_figure(counted: Tallies) -> Figure:
    """Plot the share right by case: on maps that overlap as the thesis's, and on maps of the whole hall."""
    figure, (above, below) = new_figure(1, 2, width=11.0, height=3.4)
    methods = (PLAIN, CORRECTED, OURS)
    for axes, suffix, cases in ((above, "", CASES[:-1]), (below, FULL, HALL_CASES)):
        for place, method in enumerate(methods):
            x = np.arange(len(cases)) + 0.16 * (place - 1)
            _draw_shares(axes, x, [counted[case.name + suffix, method] for case in cases], method)
        names = [case.name.replace(" and ", " + ") for case in cases]
        axes.set_xticks(range(len(cases)), names)
        axes.set_xlim(-0.6, len(CASES) - 1.4)
        in_per_cent(axes)
    _draw_thesis(above, CASES[:-1])
    write_heading(above, "Maps that overlap as those of the thesis; marks beside them: the thesis's own results")
    write_heading(below, "The same cases with full coverage")
    handles, names = above.get_legend_handles_labels()
    write_legend(figure, handles, names)
    return figure


def _draw_shares(axes: Axes, x: Sequence[float] | np.ndarray, found: Sequence[Tally], method: str) -> None:
    shares = np.array([one.share for one in found])
    bars = np.abs([[one.interval.low, one.interval.high] for one in found] - shares[:, None]).T
    marker = MARKERS[list(COLOURS).index(method)]
    axes.errorbar(
        x, shares, bars, fmt=marker, color=COLOURS[method], label=SHOWN[method], ms=6, capsize=2.5, clip_on=False
    )


def _draw_thesis(axes: Axes, cases: Sequence[Case]) -> None:
    known = [(k, case.measured) for k, case in enumerate(cases) if case.measured is not None]
    plain = [(k - 0.36, one.plain / 20) for k, one in known]
    corrected = [(k - 0.29, one.corrected / 5) for k, one in known if one.corrected is not None]
    for points, method in ((plain, PLAIN), (corrected, CORRECTED)):
        x, y = np.array(points).T
        label = f"{SHOWN[method]}, in the thesis"
        axes.plot(x, y, "_", ms=11, mew=3.0, color=COLOURS[method], alpha=0.55, label=label, clip_on=False)


@default_style()
def ablation_figure(counted: Tallies) -> Figure:
    """Plot the share right against the overlap, with each other property changed, and without parts of the method."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.5, 8.2), dpi=DPI, layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.15, 1.0))
    plane, parts, factors = (figure.add_subplot(place) for place in (grid[0, 0], grid[1, 0], grid[:, 1]))
    for axes in (plane, parts):
        quieten(axes)
    _draw_plane(plane, counted)
    _draw_parts(parts, counted)
    _draw_factors(factors, counted)
    return figure


def _draw_plane(axes: Axes, counted: Tallies) -> None:
    levels = (*LEVELS, WHOLE)
    for method, colour in COLOURS.items():
        for cleared, line in ((False, "-"), (True, "--")):
            found = [counted[plane_name(level, cleared), method] for level in levels]
            x = np.array(levels) + 0.006 * (list(COLOURS).index(method) - 1.5)
            marker = MARKERS[list(COLOURS).index(method)]
            filled = colour if not cleared else "white"
            label = SHOWN[method] if not cleared else None
            axes.plot(
                x,
                [one.share for one in found],
                line,
                color=colour,
                marker=marker,
                mfc=filled,
                ms=5.5,
                lw=1.7,
                label=label,
                clip_on=False,
            )
            if not cleared and method in (PLAIN, CORRECTED):
                low, high = [one.interval.low for one in found], [one.interval.high for one in found]
                axes.fill_between(x, low, high, color=colour, alpha=0.10, lw=0)
    axes.plot([], [], "--", color=MUTED, label="beams without a return clear 4.9 m")
    axes.axvspan(0.44, 0.70, color="#f2f3f5", zorder=-1)
    axes.text(0.57, 0.945, "overlaps of the thesis", ha="center", fontsize=9, color=MUTED)
    axes.set_xticks(levels, [*(f"{100 * level:.0f} %" for level in LEVELS), "whole\nmissions"])
    in_per_cent(axes)
    write_axes(axes, "overlap of either map; 60 % of the hall known, but for whole missions", "right")
    write_heading(axes, "Overlap decides\n\n\n")
    axes.legend(fontsize=9, frameon=False, ncols=3, loc="lower left", labelcolor=INK, bbox_to_anchor=(-0.02, 1.0))


def _draw_parts(axes: Axes, counted: Tallies) -> None:
    names = ("nothing", *PARTS)
    methods = (CORRECTED, *(without(part) for part in PARTS))
    for number, case in enumerate(SETS):
        found = [counted[case.name, method] for method in methods]
        shares = np.array([one.share for one in found])
        bars = np.abs([[one.interval.low, one.interval.high] for one in found] - shares[:, None]).T
        x, colour = np.arange(len(methods)) + 0.27 * (number - 1), ("#f0b48a", ROBOTS[1], "#8a3d00")[number]
        error = {"elinewidth": 1.0, "ecolor": INK, "capsize": 2.0}
        axes.bar(x, shares, 0.25, yerr=bars, color=colour, error_kw=error, label=case.name)
    axes.set_xticks(range(len(names)), names, rotation=20)
    in_per_cent(axes)
    write_axes(axes, "", "right")
    write_heading(axes, "Without one part of the correction\n")
    axes.legend(fontsize=9, frameon=False, ncols=3, loc="lower right", labelcolor=INK, bbox_to_anchor=(1.0, 1.0))


def _draw_factors(axes: Axes, counted: Tallies) -> None:
    columns = [(level, method) for level in (LOW_LEVEL, HIGH_LEVEL) for method in COLOURS]
    shares = np.array([[counted[factor_name(factor, lev), m].share for lev, m in columns] for factor in FACTORS])
    axes.imshow(shares, cmap="YlGnBu", vmin=0.0, vmax=1.15, aspect="auto")
    for (row, column), value in np.ndenumerate(shares):
        colour = "white" if value > 0.6 else INK
        axes.text(column, row, f"{100 * value:.0f}", ha="center", va="center", fontsize=10, color=colour)
    axes.set_xticks(range(len(columns)), [SHOWN[method].removeprefix("the ") for _, method in columns], rotation=20)
    axes.set_yticks(range(len(FACTORS)), list(FACTORS))
    axes.tick_params(labelsize=9, colors=INK, length=0)
    axes.axvline(len(COLOURS) - 0.5, color="white", lw=5)
    for place, level in enumerate((LOW_LEVEL, HIGH_LEVEL)):
        middle = (len(COLOURS) - 1) / 2 + place * len(COLOURS)
        axes.text(middle, -0.62, f"overlap {100 * level:.0f} %", ha="center", fontsize=9.5, color=INK)
    axes.spines[:].set_visible(False)
    write_heading(axes, "One other property changed [% right]\n")
