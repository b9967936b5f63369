"""coverage.json and coverage.png: share of the true free area that a team has observed over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mapping.io.atomic import write_bytes_atomically
from mapquilt.json_file import read_record, write_record
from mapquilt.runs import folder as run_folder
from mapquilt.viz.palette import INK, robot_colour
from mapquilt.viz.png import default_style, figure_png
from sim.mission.coverage import Coverage

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COVERAGE_SCHEMA = "mapquilt-coverage/1"
DIGITS = 6
"""Decimals of a share: enough for one cell of the largest world."""


def write_coverage(folder: Path, seen: Coverage) -> None:
    """Write the shares and their curves into a run."""
    record = {
        "schema": COVERAGE_SCHEMA,
        "free_area_m2": round(seen.free_area, DIGITS),
        "stamps_s": seen.stamps.tolist(),
        "team": np.round(seen.team, DIGITS).tolist(),
        "robots": [
            {"name": f"robot_{index}", "share": np.round(share, DIGITS).tolist()}
            for index, share in enumerate(seen.robots)
        ],
    }
    write_record(folder / run_folder.COVERAGE_FILE, "coverage", record)
    write_bytes_atomically(folder / run_folder.COVERAGE_PICTURE, figure_png(_curves(seen)))


def coverage_line(folder: Path) -> str:
    """Describe the final coverage of a run in one line."""
    record = read_record(folder / run_folder.COVERAGE_FILE, "coverage")
    each = ", ".join(f"{100 * robot['share'][-1]:.0f} %" for robot in record["robots"])
    return f"seen of the {record['free_area_m2']:.0f} m^2 of free floor: {100 * record['team'][-1]:.0f} % ({each})"


@default_style()
def _curves(seen: Coverage) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.0, 3.2), layout="constrained", dpi=110)
    panel = figure.add_subplot()
    panel.plot(seen.stamps, 100.0 * seen.team, color=INK, linewidth=1.8, label="team")
    for index, share in enumerate(seen.robots):
        panel.plot(seen.stamps, 100.0 * share, color=robot_colour(index), linewidth=1.1, label=f"robot_{index}")
    panel.set_ylim(0.0, 100.0)
    panel.set_xlim(0.0, max(float(seen.stamps[-1]), 1.0))
    panel.set_xlabel("time [s]", fontsize=8, color=INK)
    panel.set_title(f"seen of {seen.free_area:.0f} m^2 of free floor [%]", fontsize=9, color=INK, loc="left")
    panel.tick_params(labelsize=7, colors=INK, length=2)
    panel.grid(color="#e3e6ea", linewidth=0.6)
    for spine in panel.spines.values():
        spine.set_color("#d0d4d9")
    panel.legend(fontsize=7, framealpha=0.9, ncols=1 + len(seen.robots) // 8)
    return figure
