"""Draw the picture of docs/simulation.md from a run: ``python docs/simulation_example.py RUN PICTURE``."""

from __future__ import annotations

import sys
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mapping.io.atomic import write_bytes_atomically
from mapquilt.runs import folder as run_folder
from mapquilt.viz.palette import INK, robot_colour
from mapquilt.viz.png import figure_png
from mapquilt.viz.world_picture import draw_world
from sim.mission.coverage import Coverage, coverage
from sim.mission.file import load_mission
from sim.mission.mission import Mission


def main(run: Path, picture: Path) -> None:
    mission = load_mission(run / run_folder.MISSION_FOLDER)
    figure = Figure(figsize=(14.0, 5.6), layout="constrained", dpi=100)
    left, right = figure.subplots(1, 2, width_ratios=(1.7, 1.0))
    draw_paths(left, mission)
    draw_coverage(right, coverage(mission))
    write_bytes_atomically(picture, figure_png(figure))


def draw_paths(axes: Axes, mission: Mission) -> None:
    draw_world(axes, mission.world)
    for index, robot in enumerate(mission.robots):
        path = robot.trajectory.poses
        axes.plot(path[:, 0], path[:, 1], color=robot_colour(index), linewidth=1.2)
        axes.plot(*path[0, :2], "o", color=robot_colour(index), markersize=6, markeredgecolor="white")
    axes.set_title("true paths, starts as dots [m]", fontsize=10, color=INK, loc="left")


def draw_coverage(axes: Axes, seen: Coverage) -> None:
    for index, share in enumerate(seen.robots):
        axes.plot(seen.stamps, 100.0 * share, color=robot_colour(index), linewidth=1.2, label=f"robot_{index}")
    axes.plot(seen.stamps, 100.0 * seen.team, color=INK, linewidth=2.0, label="team")
    axes.set(xlim=(0.0, float(seen.stamps[-1])), ylim=(0.0, 100.0))
    axes.set_xlabel("time [s]", fontsize=9, color=INK)
    axes.set_title(f"seen of {seen.free_area:.0f} m^2 of free floor [%]", fontsize=10, color=INK, loc="left")
    axes.tick_params(labelsize=8, colors=INK)
    axes.grid(color="#e3e6ea", linewidth=0.6)
    axes.legend(fontsize=8, loc="upper left", frameon=False)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
