"""Picture of a trajectory over its reference, with the errors over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mapquilt.viz.palette import TRUE_WALL, robot_colour
from mapquilt.viz.plot_style import DPI, quieten, write_axes, write_heading
from mapquilt.viz.png import default_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@default_style()
def trajectory_figure(
    stamps: NDArray[np.float64],
    estimate: NDArray[np.float64],
    reference: NDArray[np.float64],
    position: NDArray[np.float64],
    yaw: NDArray[np.float64],
) -> Figure:
    """Draw both paths (N, 3) [m] in the reference's frame, and the errors of ``position`` [m] and ``yaw`` [rad] over
    time (N,)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 5.2), layout="constrained", dpi=DPI)
    areas = figure.add_gridspec(2, 2, width_ratios=(1.25, 1.0))
    paths = figure.add_subplot(areas[:, 0])
    panels = [figure.add_subplot(areas[0, 1]), figure.add_subplot(areas[1, 1])]
    for panel in (paths, *panels):
        quieten(panel)
    paths.plot(*reference[:, :2].T, color=TRUE_WALL, linewidth=3.0, label="reference")
    paths.plot(*estimate[:, :2].T, color=robot_colour(0), linewidth=1.1, label="estimate")
    paths.set_aspect("equal", adjustable="datalim")
    paths.grid(axis="x", color="#dfe3e8", linewidth=0.8)
    write_heading(paths, "paths after alignment")
    write_axes(paths, "x [m]", "y [m]")
    paths.legend(frameon=False, fontsize=9, loc="best")
    elapsed = stamps - stamps[0]
    texts = (("position error", "m", position), ("yaw error", "degrees", np.degrees(yaw)))
    for panel, (heading, unit, errors) in zip(panels, texts, strict=True):
        panel.plot(elapsed, errors, color=robot_colour(1), linewidth=1.0)
        panel.set_ylim(bottom=0.0)
        panel.set_xlim(0.0, max(float(elapsed[-1]), 1e-9))
        root = float(np.sqrt(np.mean(errors**2)))
        write_heading(panel, f"{heading}: {root:.3g} {unit} RMSE, {errors.max():.3g} {unit} at most")
        write_axes(panel, "time [s]", f"error [{unit}]")
    return figure
