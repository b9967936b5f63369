"""Draw the picture of docs/noise.md from a run: ``python docs/noise_example.py RUN PICTURE``."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mapping.geometry.se2 import SE2
from mapping.grid.log_odds import map_log
from mapping.grid.sensor_model import sensor_model
from mapping.robot.robot_log import RobotTruth
from mapping.robot.scan import LidarScan
from mapquilt.runs import folder as run_folder
from mapquilt.viz.palette import TRUE_WALL, UNKNOWN, picture, robot_colour
from mapquilt.viz.png import figure_png
from sim.mission.file import load_mission
from sim.sensors.lidar_presets import lidar_preset
from sim.sensors.noise import Noise
from sim.sensors.sensing import SensedLog, sense

LEVELS = (0.0, 1.0, 3.0)
AT = 0.3
"""Time of the scan that is shown, as a share of the mission."""
SHOWN = 6.0
"""Half the side of the shown square around the robot [m]."""


def main(run: Path, out: Path) -> None:
    mission = load_mission(run / run_folder.MISSION_FOLDER)
    lidar, truth = mission.settings.robots[0].lidar.model, mission.robots[0]
    figure = Figure(figsize=(15, 8.6), layout="constrained", dpi=100)
    panels = figure.subplots(2, 3, sharex="row", sharey="row")
    for (above, below), level in zip(panels.T, LEVELS, strict=True):
        sensed = sense(truth, Noise.level(level, lidar_preset(lidar).noise), mission.seed, 0)
        draw_scan(above, truth, sensed)
        above.set_title(f"one scan of {lidar} at noise {level:g}", fontsize=10, loc="left")
        draw_map(below, truth, sensed)
        below.set_title(f"map by odometry at noise {level:g}, its path, and the true path", fontsize=10, loc="left")
    out.write_bytes(figure_png(figure))


def draw_scan(axes: Axes, truth: RobotTruth, sensed: SensedLog) -> None:
    index = int(AT * len(truth.scans))
    clean, read = truth.scans[index], sensed.log.scans[index]
    axes.plot(*clean.points().T, ".", color=TRUE_WALL, markersize=6)
    axes.plot(*read.points().T, ".", color=robot_colour(0), markersize=2.5)
    axes.plot(*replaced_endpoints(read, sensed.outliers[index]).T, "x", color=robot_colour(1), markersize=5)
    axes.plot(0.0, 0.0, "^", color="black", markersize=6)
    axes.set(aspect="equal", xlim=(-SHOWN, SHOWN), ylim=(-SHOWN * 0.7, SHOWN * 0.7))
    axes.tick_params(labelsize=7)


def replaced_endpoints(scan: LidarScan, replaced: np.ndarray) -> np.ndarray:
    """Return the endpoints (N, 2) of the readings that noise replaced."""
    points: np.ndarray = scan.points()[replaced[scan.returned]]
    return points


def draw_map(axes: Axes, truth: RobotTruth, sensed: SensedLog) -> None:
    grid = map_log(sensed.log, sensed.log.odometry.from_start(), 0.05, sensor_model("octomap"), 0.0)
    (low_x, low_y), (high_x, high_y) = grid.frame.metres_from_cells(np.array([(0, 0), np.array(grid.frame.shape) - 1]))
    half = grid.frame.resolution / 2.0
    axes.imshow(picture(grid), origin="lower", extent=(low_x - half, high_x + half, low_y - half, high_y + half))
    start = truth.trajectory.pose(0)
    axes.plot(*path(truth, start).T, "--", color=robot_colour(1), linewidth=1.0)
    axes.plot(*sensed.log.odometry.poses[:, :2].T, "-", color=robot_colour(0), linewidth=1.0)
    red, green, blue = (level / 255 for level in UNKNOWN)
    axes.set_facecolor((red, green, blue))
    axes.tick_params(labelsize=7)


def path(truth: RobotTruth, start: SE2) -> np.ndarray:
    return start.inverse().apply(truth.trajectory.poses[:, :2])


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
