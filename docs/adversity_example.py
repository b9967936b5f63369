"""Draw the picture of adversity in docs/noise.md: ``python docs/adversity_example.py RUN PICTURE``."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mapping.geometry.se2 import SE2
from mapping.io.atomic import write_bytes_atomically
from mapquilt.runs import folder as run_folder
from mapquilt.viz.palette import INK, TRUE_WALL, robot_colour
from mapquilt.viz.png import figure_png
from mapquilt.viz.world_picture import draw_world
from sim.mission.file import load_mission
from sim.mission.mission import Mission
from sim.sensors.adversity.settings import LEVEL_ONE, Adversity
from sim.sensors.adversity.surroundings import Surroundings, draw_surroundings
from sim.sensors.noise import Noise
from sim.sensors.sensing import SensedLog, sense

SCANS = {
    "people walk": Adversity(people=6.0),
    "doors close, objects come and go": Adversity(doors=1.0, objects=4.0),
    "a third of the walls is of glass": Adversity(glass=0.33),
    "on a ramp": Adversity(ramps=3.0, ramp_radius=1.5),
    "all at level 1": LEVEL_ONE,
}
SLIP = Adversity(slip=0.2)
LATE = Adversity(latency=0.2)
SHOWN = 8.0
"""Half the width of the shown part of the world [m]."""


def main(run: Path, out: Path) -> None:
    mission = load_mission(run / run_folder.MISSION_FOLDER)
    figure = Figure(figsize=(16, 7.4), layout="constrained", dpi=100)
    clean, *panels = figure.subplots(2, 4).flat
    draw_scan(clean, mission, Adversity(), turning(mission), "the clean scan of a turning robot")
    for panel, (title, adversity) in zip(panels, SCANS.items(), strict=False):
        draw_scan(panel, mission, adversity, None, title)
    draw_scan(panels[5], mission, LATE, turning(mission), "0.2 s late in a turn")
    draw_paths(panels[6], mission)
    write_bytes_atomically(out, figure_png(figure))


def turning(mission: Mission) -> int:
    """Return the number of the scan at which the first robot turns fastest."""
    yaw = np.unwrap(mission.robots[0].trajectory.poses[:, 2])
    return int(np.abs(np.diff(yaw)).argmax())


def quiet(mission: Mission, adversity: Adversity) -> tuple[SensedLog, Surroundings | None]:
    """Sense the first robot without other noise."""
    paths = [robot.trajectory for robot in mission.robots]
    around = draw_surroundings(mission.world, paths, adversity, mission.seed)
    noise = Noise(Noise.level(0.0).lidar, Noise.level(0.0).odometry, adversity)
    return sense(mission.robots[0], noise, mission.seed, 0, around), around


def draw_scan(axes: Axes, mission: Mission, adversity: Adversity, index: int | None, title: str) -> None:
    """Draw a scan above the clean one (grey), by default the one with the most changed readings (orange)."""
    truth, (sensed, around) = mission.robots[0], quiet(mission, adversity)
    index = int(sensed.outliers.sum(axis=1).argmax()) if index is None else index
    world_from_start = truth.trajectory.pose(0)
    believed = world_from_start @ sensed.log.odometry.pose(index) @ truth.base_from_lidar
    scan, true = sensed.log.scans[index], truth.trajectory.pose(index) @ truth.base_from_lidar
    points, changed = believed.apply(scan.points()), sensed.outliers[index][scan.returned]
    draw_world(axes, mission.world)
    if around is not None:
        draw_surroundings_at(axes, around, scan.stamp)
    axes.plot(*true.apply(truth.scans[index].points()).T, ".", color=TRUE_WALL, markersize=6)
    axes.plot(*points[~changed].T, ".", color=robot_colour(0), markersize=4)
    axes.plot(*points[changed].T, ".", color=robot_colour(1), markersize=5)
    draw_robot(axes, true)
    half = np.array((SHOWN, 0.8 * SHOWN))
    low = np.clip(np.array((true.x, true.y)) - half, 0.0, np.maximum(0.0, mission.world.size - 2.0 * half))
    high = low + 2.0 * half
    axes.set(xlim=(low[0] - 0.5, high[0] + 0.5), ylim=(low[1] - 0.5, high[1] + 0.5))
    axes.set_title(title, fontsize=10, color=INK, loc="left")


def draw_robot(axes: Axes, pose: SE2) -> None:
    tip = pose.apply(np.array([(0.6, 0.0)]))[0]
    axes.plot((pose.x, tip[0]), (pose.y, tip[1]), "-", color=INK, linewidth=1.5)
    axes.plot(pose.x, pose.y, "o", color=INK, markersize=7)


def draw_surroundings_at(axes: Axes, around: Surroundings, time: float) -> None:
    """Draw people (circles), doors and objects (red), panes (light blue) and ramps (triangles) at a time [s]."""
    axes.plot(*around.people.at(time).T, "o", markeredgecolor=robot_colour(2), markerfacecolor="none", markersize=9)
    for segment in around.movables.at(time):
        axes.plot(*segment.T, "-", color="#c1121f", linewidth=2.0)
    for pane in around.glass.panes:
        axes.plot(*pane.T, "-", color=robot_colour(5), linewidth=2.5)
    axes.plot(*around.ramps.middles.T, "^", markeredgecolor=robot_colour(3), markerfacecolor="none", markersize=9)


def draw_paths(axes: Axes, mission: Mission) -> None:
    """Draw the true path (dashed), and odometry whose only error is slip."""
    truth, (sensed, _) = mission.robots[0], quiet(mission, SLIP)
    draw_world(axes, mission.world)
    axes.plot(*truth.trajectory.poses[:, :2].T, "--", color=INK, linewidth=1.2)
    believed = sensed.log.odometry.moved(truth.trajectory.pose(0)).poses
    axes.plot(*believed[:, :2].T, "-", color=robot_colour(1), linewidth=1.2)
    axes.set_title("wheels slip in turns: odometry, and the true path", fontsize=10, color=INK, loc="left")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
