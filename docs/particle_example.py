"""Draw the picture of docs/particle.md from a run: ``python docs/particle_example.py RUN PICTURE``."""

from __future__ import annotations

import sys
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mapping.geometry.se2 import SE2
from mapping.io.atomic import write_bytes_atomically
from mapping.io.robot_log_file import load_robot_log
from mapping.particle.filter import ParticleResult, particle_filter
from mapping.robot.robot_log import RobotLog
from mapping.robot.trajectory import Trajectory
from mapquilt.runs import folder as run_folder
from mapquilt.viz.palette import INK, picture, robot_colour
from mapquilt.viz.png import figure_png
from sim.mission.file import load_mission


def main(run: Path, out: Path) -> None:
    log = load_robot_log(run / "robot_0" / run_folder.LOG_FILE)
    true = load_mission(run / run_folder.MISSION_FOLDER).robots[0].trajectory.from_start()
    result = particle_filter(log)
    figure = Figure(figsize=(14.0, 5.6), layout="constrained", dpi=100)
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1.0))
    draw_paths(left, result, log, true)
    draw_effective_size(right, result, log)
    write_bytes_atomically(out, figure_png(figure))


def draw_paths(axes: Axes, result: ParticleResult, log: RobotLog, true: Trajectory) -> None:
    frame = result.grid.frame
    rows, cols = frame.shape
    low, high = frame.origin, frame.origin @ SE2(cols * frame.resolution, rows * frame.resolution)
    axes.imshow(picture(result.grid), origin="lower", extent=(low.x, high.x, low.y, high.y))
    axes.plot(*log.odometry.from_start().poses[:, :2].T, color=robot_colour(1), linewidth=1.0, label="odometry")
    for path in result.paths:
        axes.plot(*path[:, :2].T, color=robot_colour(0), linewidth=0.6)
    axes.plot(*result.trajectory.poses[:, :2].T, color=robot_colour(0), linewidth=1.4, label="particles")
    axes.plot(*true.poses[:, :2].T, "--", color=INK, linewidth=1.0, label="true path")
    axes.set_title("map of the best particle, and the paths of all [m]", fontsize=10, color=INK, loc="left")
    axes.legend(fontsize=8, loc="upper right")


def draw_effective_size(axes: Axes, result: ParticleResult, log: RobotLog) -> None:
    stamps = log.odometry.stamps[result.updates]
    axes.plot(stamps, result.effective_sizes, color=robot_colour(0), linewidth=1.2)
    chosen = list(result.resampled)
    axes.plot(stamps[chosen], result.effective_sizes[chosen], "v", color=robot_colour(1), label="resampled")
    axes.axhline(len(result.paths) / 2, color=INK, linewidth=0.8, linestyle=":")
    axes.set(xlim=(0.0, float(log.odometry.stamps[-1])), ylim=(0.0, len(result.paths) + 0.5))
    axes.set_xlabel("time [s]", fontsize=9, color=INK)
    axes.set_title(f"effective sample size of {len(result.paths)} particles", fontsize=10, color=INK, loc="left")
    axes.legend(fontsize=8, loc="lower right")
    axes.grid(color="#e3e6ea", linewidth=0.6)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
