"""Reliability diagram: share of right answers over confidence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mapquilt.evaluation.calibration import Calibration
from mapquilt.viz.palette import INK, ROBOTS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 3


def reliability_figure(calibrations: Sequence[Calibration]) -> Figure:
    """Draw bins of equal mass with Wilson's intervals, a panel per method; a calibrated one lies on the diagonal."""
    from matplotlib.figure import Figure

    columns = min(COLUMNS, len(calibrations))
    rows = math.ceil(len(calibrations) / columns)
    figure = Figure(figsize=(4.4 * columns, 5.0 * rows), layout="constrained", dpi=110)
    for index, found in enumerate(calibrations):
        axes = figure.add_subplot(rows, columns, index + 1)
        _draw(axes, found, ROBOTS[index % len(ROBOTS)])
        if index % columns == 0:
            axes.set_ylabel("share of right answers", color=INK)
    return figure


def _draw(axes: Axes, found: Calibration, colour: str) -> None:
    axes.plot((0.0, 1.0), (0.0, 1.0), color="#b9bec6", linewidth=1.0, linestyle="--")
    confidence = np.array([one.confidence for one in found.bins])
    right = np.array([one.right.value for one in found.bins])
    low = right - np.array([one.right.interval.low for one in found.bins])
    high = np.array([one.right.interval.high for one in found.bins]) - right
    axes.errorbar(
        confidence, right, yerr=np.maximum(0.0, (low, high)), color=colour, fmt="o-", linewidth=0.8, capsize=3
    )
    axes.set_xlim(-0.02, 1.02)
    axes.set_ylim(-0.02, 1.02)
    axes.set_aspect("equal")
    axes.set_xlabel("confidence", color=INK)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8, colors=INK)
    auc = "-" if found.auc is None else f"{found.auc:.3f}"
    brier = f"Brier {found.brier:.3f} (base rate {found.base_brier:.3f})"
    axes.set_title(
        f"{found.method}: {found.pairs} pairs\n{brier}, ECE {found.ece:.3f}, AUC {auc}",
        fontsize=9,
        loc="left",
        color=INK,
    )
