"""Draw the picture of docs/slam.md from a run: ``python docs/slam_example.py RUN PICTURE``."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mapping.grid.log_odds import map_log
from mapping.io.robot_log_file import load_robot_log
from mapping.robot.trajectory import Trajectory
from mapping.slam.pipeline import slam
from mapping.slam.result import SlamResult
from mapquilt.evaluation.trajectory_error import absolute_error
from mapquilt.runs import folder as run_folder
from mapquilt.viz.palette import INK, picture, robot_colour
from mapquilt.viz.png import figure_png
from sim.mission.file import load_mission


def main(run: Path, out: Path) -> None:
    true = load_mission(run / run_folder.MISSION_FOLDER).robots[0].trajectory
    log = load_robot_log(run / "robot_0/log.npz")
    result = slam(log)
    shown = (
        ("odometry", log.odometry.from_start(), None),
        ("SLAM, with keyframes and loops", result.trajectory, result),
        ("true poses", true.from_start(), None),
    )
    figure = Figure(figsize=(15.0, 5.2), layout="constrained", dpi=100)
    for axes, (title, poses, solved) in zip(figure.subplots(1, 3), shown, strict=True):
        grid = map_log(log, poses)
        low = grid.frame.metres_from_cells(np.array([[-0.5, -0.5]]))[0]
        high = grid.frame.metres_from_cells(np.array(grid.frame.shape)[None] - 0.5)[0]
        axes.imshow(picture(grid), extent=(low[0], high[0], low[1], high[1]), origin="lower")
        draw_path(axes, poses, solved)
        error = float(np.sqrt(np.mean(absolute_error(poses, true).position ** 2)))
        note = "" if poses is shown[2][1] else f": errs by {1000.0 * error:.0f} mm"
        axes.set_title(f"{title}{note}", fontsize=10, color=INK, loc="left")
        axes.tick_params(labelsize=8, colors=INK)
    out.write_bytes(figure_png(figure))


def draw_path(axes: Axes, poses: Trajectory, solved: SlamResult | None) -> None:
    axes.plot(*poses.poses[:, :2].T, color=robot_colour(0), linewidth=1.0)
    if solved is not None:
        nodes = poses.poses[solved.keyframes]
        axes.plot(*nodes[:, :2].T, ".", color=robot_colour(0), markersize=4)
        for edge in solved.loops:
            axes.plot(*nodes[[edge.first, edge.second], :2].T, color=robot_colour(1), linewidth=1.2)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]", fontsize=9, color=INK)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
