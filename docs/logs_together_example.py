"""Draw docs/logs-together.png from a run: ``python docs/logs_together_example.py RUN PICTURE``."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from mapping.grid.log_odds import map_log
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapping.settings import MappingSettings
from mapquilt.logs.load_log import LogSource, load_log
from mapquilt.merging.joint_maps import draw_jointly
from mapquilt.viz.palette import INK, picture
from mapquilt.viz.png import figure_png
from merge.merger import merge_maps
from merge.settings import MergeSettings


def main(run: Path, out: Path) -> None:
    logs = load_log(run, LogSource())
    names = tuple(log.name for log in logs)
    drifted = tuple(map_log(log.recorded.log, log.recorded.log.odometry.from_start()) for log in logs)
    joint = draw_jointly(logs, MappingSettings(), MergeSettings())
    panels = {
        "maps at odometry, merged": merged(names, drifted, MergeSettings()),
        "the same maps, bent (--elastic)": merged(names, drifted, MergeSettings(elastic=True)),
        "logs, poses optimised together (--elastic)": merged(
            names, tuple(joint.grids[name] for name in names), MergeSettings()
        ),
    }
    figure = Figure(figsize=(15.0, 5.0), layout="constrained", dpi=100)
    for axes, (title, grid) in zip(figure.subplots(1, 3), panels.items(), strict=True):
        low = grid.frame.metres_from_cells(np.array([[-0.5, -0.5]]))[0]
        high = grid.frame.metres_from_cells(np.array(grid.frame.shape)[None] - 0.5)[0]
        axes.imshow(picture(grid), extent=(low[0], high[0], low[1], high[1]), origin="lower")
        axes.set_title(title, fontsize=10, color=INK, loc="left")
        axes.set_xlabel("x [m]", fontsize=9, color=INK)
        axes.tick_params(labelsize=8, colors=INK)
    out.write_bytes(figure_png(figure))


def merged(names: tuple[str, ...], grids: tuple[OccupancyGrid, ...], settings: MergeSettings) -> OccupancyGrid:
    return merge_maps(MapSet(names, grids, tuple("m" for _ in names)), settings).merged.cropped(10)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
