"""Reliability diagram: share of right answers over confidence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from mapping.wording import counted
from mapquilt.evaluation.calibration import Calibration
from mapquilt.evaluation.formatting import number_text
from mapquilt.viz.plot_style import MUTED, draw_series, in_per_cent, new_figure, write_axes, write_heading
from mapquilt.viz.png import default_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = 2


@default_style()
def reliability_figure(calibrations: Sequence[Calibration], series: Sequence[int] | None = None) -> Figure:
    """Draw bins of equal mass with Wilson's intervals, a panel per method; a calibrated one lies on the diagonal.

    ``series`` are the methods' numbers, which choose their colours; by default they are counted.
    """
    columns = min(COLUMNS, len(calibrations))
    figure, panels = new_figure(columns, -(-len(calibrations) // columns), width=3.9, height=3.9)
    for number, (panel, found) in enumerate(zip(panels, calibrations, strict=False)):
        panel.plot((0, 1), (0, 1), color=MUTED, linewidth=1.0, linestyle="--")
        points = [(one.confidence, one.right.value, one.right.interval) for one in found.bins]
        draw_series(panel, points, number if series is None else series[number])
        panel.set_xlim(-0.03, 1.03)
        in_per_cent(panel)
        brier = f"Brier {found.brier:.3f} (of the base rate {found.base_brier:.3f})"
        numbers = f"{brier}\nECE {found.ece:.3f}, AUC {number_text(found.auc, 3)}"
        write_heading(panel, f"{found.method}: {counted(found.pairs, 'pair')}")
        write_axes(panel, f"confidence\n{numbers}", "" if number % columns else "share of right answers")
    for panel in panels[len(calibrations) :]:
        panel.set_axis_off()
    return figure
