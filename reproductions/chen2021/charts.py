"""Plots of the shares of right answers and of the acceptance indices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mapquilt.viz.palette import INK, ROBOTS
from mapquilt.viz.png import default_style
from reproductions.chen2021.cases import CASES
from reproductions.chen2021.make import Study
from reproductions.chen2021.methods import CORRECTED, PLAIN
from reproductions.chen2021.tally import CaseTally

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 110
COLOURS = {PLAIN: ROBOTS[0], CORRECTED: ROBOTS[1], "sift": ROBOTS[5], "morphology": ROBOTS[4], "quilt": ROBOTS[2]}
"""Colours of the plotted methods."""
WRONG = "#c1121f"
LEAST_INDEX = 0.84
"""Lower end of the plot of indices; lower ones are drawn on its edge."""


@default_style()
def right_figure(counted: Sequence[CaseTally]) -> Figure:
    """Plot the share of right answers by case, with Wilson's intervals, and the thesis's own."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.5, 4.8), dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    shown = [method for method in COLOURS if any(one.method == method for one in counted)]
    for place, method in enumerate(shown):
        chosen = [one for one in counted if one.method == method]
        x = np.arange(len(chosen)) + 0.13 * (place - (len(shown) - 1) / 2.0)
        shares = np.array([100 * one.right.value for one in chosen])
        low = shares - [100 * one.right.interval.low for one in chosen]
        high = np.array([100 * one.right.interval.high for one in chosen]) - shares
        bars = np.maximum(np.stack((low, high)), 0.0)
        axes.errorbar(x, shares, bars, fmt="o", ms=5, capsize=3, lw=1.3, color=COLOURS[method], label=method)
    _draw_thesis(axes)
    axes.set_xticks(range(len(CASES)), [case.name.replace(" and ", " + ") for case in CASES], fontsize=8, color=INK)
    axes.set(ylim=(-4, 104), xlim=(-0.6, len(CASES) - 0.4))
    axes.set_ylabel("right [%]", color=INK)
    axes.grid(axis="y", color="#e4e7eb", lw=0.7)
    figure.legend(loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    axes.set_title(
        f"Right within 10 cells, 5 degrees and 5 % of scale; seeds: {counted[0].right.of}; Wilson's 95 % intervals",
        loc="left",
        fontsize=10,
        color=INK,
    )
    return figure


def _draw_thesis(axes: Axes) -> None:
    known = [(k, case.measured) for k, case in enumerate(CASES) if case.measured is not None]
    plain = [(k, 100 * m.plain / m.plain_runs) for k, m in known]
    corrected = [(k, 100 * m.corrected / m.corrected_runs) for k, m in known if m.corrected is not None]
    for points, method, shift in ((plain, PLAIN, -0.4), (corrected, CORRECTED, 0.4)):
        axes.plot(
            [k + shift for k, _ in points],
            [share for _, share in points],
            "_",
            ms=11,
            mew=2.4,
            color=COLOURS[method],
            alpha=0.55,
            label=f"{method.split()[0]}: the thesis",
        )


@default_style()
def index_figure(study: Study) -> Figure:
    """Plot the acceptance index at each answer, before and after the correction, and at the truth."""
    from matplotlib.figure import Figure

    cases = [case for case in CASES if not case.team]
    figure = Figure(figsize=(12.5, 4.6), dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    for place, case in enumerate(cases):
        for method, shift in ((PLAIN, -0.22), (CORRECTED, 0.0)):
            for right, marker, colour in ((True, "o", COLOURS[method]), (False, "x", WRONG)):
                chosen = [
                    a for a in study.answers if (a.case, a.pair.method, a.pair.right) == (case.name, method, right)
                ]
                values = np.array([a.index for a in chosen if a.index is not None])
                x = place + shift + 0.14 * ((np.arange(len(values)) + 0.5) / max(len(values), 1) - 0.5)
                shown = values >= LEAST_INDEX
                axes.plot(x[shown], values[shown], marker, ms=3.6, color=colour, mew=1.0, alpha=0.8)
                below = np.full(np.count_nonzero(~shown), LEAST_INDEX + 0.003)
                axes.plot(x[~shown], below, "v", ms=3.6, color=colour, mew=1.0, alpha=0.8)
        true = {a.seed: a.true_index for a in study.answers if a.case == case.name and a.true_index is not None}
        axes.plot([place + 0.22] * len(true), list(true.values()), "_", ms=12, color=INK, mew=0.8)
    for method in (PLAIN, CORRECTED):
        axes.plot([], [], "o", ms=4, color=COLOURS[method], label=f"{method}, right")
    axes.plot([], [], "x", ms=4, color=WRONG, label="wrong")
    axes.plot([], [], "v", ms=4, color=WRONG, label=f"wrong, below {LEAST_INDEX:g}")
    axes.plot([], [], "_", ms=12, color=INK, label="at the truth")
    axes.set_xticks(range(len(cases)), [case.name.replace(" and ", " + ") for case in cases], fontsize=8, color=INK)
    axes.set(ylim=(LEAST_INDEX, 1.004), xlim=(-0.6, len(cases) - 0.4))
    axes.set_ylabel("acceptance index", color=INK)
    axes.grid(axis="y", color="#e4e7eb", lw=0.7)
    figure.legend(loc="outside lower center", ncols=5, fontsize=8, frameon=False)
    title = "Acceptance index before and after the correction, on the original rasters"
    axes.set_title(title, loc="left", fontsize=10, color=INK)
    return figure
