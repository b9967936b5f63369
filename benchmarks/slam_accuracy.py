"""Accuracy of SLAM in the simulator, family by family and noise level by noise level.

``python -m benchmarks.slam_accuracy --levels 1,3 --seeds 101,102 --out accuracy`` writes accuracy.csv, one row for each
robot, and accuracy.png, and prints the means. ``--view 180`` keeps the beams ahead, ``--range 3.5`` the near readings,
``--component adversity.slip=1`` sets a component of the noise.
"""

from __future__ import annotations

import argparse
import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.log_odds import map_log
from mapping.ground_truth.beam_endpoints import beam_endpoints
from mapping.ground_truth.truth import map_truth
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory
from mapping.slam.pipeline import slam
from mapquilt.evaluation.map_quality import map_quality, observed_part
from mapquilt.evaluation.trajectory_error import absolute_error
from mapquilt.runs.open_world import open_world
from mapquilt.runs.true_footprints import TrueFootprints, true_footprints
from mapquilt.viz.png import figure_png
from mapquilt.viz.text_table import plain_table
from sim.mission.mission import Mission
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.sensors.lidar_presets import lidar_preset
from sim.sensors.noise import Noise
from sim.sensors.sensing import SensedLog, sense

FAMILIES = ("office", "corridor_loop", "house", "warehouse", "cave", "open_hall", "maze", "hospital")
ROBOTS = 2


@dataclass(frozen=True)
class Row:
    """Errors of one robot: root mean square of position [m] and yaw [deg] after rigid alignment, distortion of the map
    [m], wall F1 of the map at its best fit, number of loops, processor time per scan [ms]."""

    family: str
    seed: int
    robot: int
    level: float
    odometry_m: float
    slam_m: float
    yaw_deg: float
    distortion_m: float
    f1_odometry: float
    f1_slam: float
    f1_truth: float
    loops: int
    ms_per_scan: float


@dataclass(frozen=True)
class Sensing:
    """What the robots sense: the ``view`` of their lidar [rad] and its ``reach`` [m], and components of the noise."""

    view: float = math.tau
    reach: float = math.inf
    components: tuple[tuple[str, float], ...] = ()

    def limited(self, scan: LidarScan) -> LidarScan:
        """Keep the beams ahead; readings beyond the reach are no return."""
        kept = np.abs(scan.angles) <= 0.5 * self.view + 1e-9
        ranges = np.where(scan.ranges > self.reach, np.float32(np.inf), scan.ranges)[kept]
        first = float(scan.angles[kept][0])
        return replace(scan, angle_min=first, ranges=ranges, range_max=min(scan.range_max, self.reach))


def rows(
    families: Sequence[str], seeds: Sequence[int], levels: Sequence[float], duration: float, sensing: Sensing
) -> Iterator[Row]:
    """Simulate each mission once, and map it at each level."""
    for family in families:
        for seed in seeds:
            world, _ = open_world(family, seed)
            mission, _ = simulate(world, MissionSettings(ROBOTS, duration), seed)
            places = true_footprints(mission)
            for level in levels:
                for robot in range(ROBOTS):
                    yield _row(family, mission, places, robot, level, sensing)


def _row(family: str, mission: Mission, places: TrueFootprints, robot: int, level: float, sensing: Sensing) -> Row:
    truth = mission.robots[robot]
    noise = Noise.level(level, lidar_preset(mission.settings.robots[robot].lidar.model).noise)
    sensed = sense(truth, noise.with_fields(sensing.components), mission.seed, robot)
    log = replace(sensed.log, scans=tuple(sensing.limited(scan) for scan in sensed.log.scans))
    result = slam(log)
    error = absolute_error(result.trajectory, truth.trajectory)
    odometry = absolute_error(log.odometry, truth.trajectory)
    qualities = {
        name: _fit(sensed, log, mission, places, robot, poses)
        for name, poses in (
            ("odometry", log.odometry.from_start()),
            ("slam", result.trajectory),
            ("truth", truth.trajectory.from_start()),
        )
    }
    return Row(
        family=family,
        seed=mission.seed,
        robot=robot,
        level=level,
        odometry_m=rms(odometry.position),
        slam_m=rms(error.position),
        yaw_deg=math.degrees(rms(error.yaw)),
        distortion_m=qualities["slam"][0],
        f1_odometry=qualities["odometry"][1],
        f1_slam=qualities["slam"][1],
        f1_truth=qualities["truth"][1],
        loops=len(result.loops),
        ms_per_scan=1000.0 * sum(result.timings.values()) / len(log.scans),
    )


def rms(values: NDArray[np.float64]) -> float:
    return math.sqrt(float(np.mean(np.square(values))))


def _fit(
    sensed: SensedLog, log: RobotLog, mission: Mission, places: TrueFootprints, robot: int, poses: Trajectory
) -> tuple[float, float]:
    """Return distortion [m], by all readings, and wall F1 of the map of a log at the transform that fits it best."""
    truth = mission.robots[robot]
    fitted = map_truth(
        beam_endpoints(sensed.log, truth, poses, sensed.outliers), truth.trajectory.pose(0), Similarity2.identity()
    )
    observed = observed_part(places.world, [places.maps[robot].footprint])
    return fitted.distortion, map_quality(map_log(log, poses), fitted.world_from_map, observed).f1_walls


def table(measured: Sequence[Row]) -> Table:
    """Return the means of each family and level, and the largest position error."""
    columns = ("family", "noise", "odom. m", "SLAM m", "max m", "deg", "dist. m", "F1", "true", "ms")
    shown = plain_table(*((name, name != "family") for name in columns))
    for level in dict.fromkeys(row.level for row in measured):
        for family in dict.fromkeys(row.family for row in measured):
            part = [row for row in measured if (row.family, row.level) == (family, level)]
            mean = {name: float(np.mean([getattr(row, name) for row in part])) for name in _NUMBERS}
            shown.add_row(
                family,
                f"{level:g}",
                f"{mean['odometry_m']:.3f}",
                f"{mean['slam_m']:.4f}",
                f"{max(row.slam_m for row in part):.4f}",
                f"{mean['yaw_deg']:.2f}",
                f"{mean['distortion_m']:.3f}",
                f"{mean['f1_slam']:.3f}",
                f"{mean['f1_truth']:.3f}",
                f"{mean['ms_per_scan']:.1f}",
            )
    return shown


_NUMBERS = tuple(each.name for each in fields(Row) if each.name not in ("family", "seed", "robot"))


def picture(measured: Sequence[Row]) -> Figure:
    """Draw each robot's error by odometry and by SLAM, against the noise level."""
    figure = Figure(figsize=(9, 4.2), layout="constrained", dpi=110)
    left, right = figure.subplots(1, 2)
    levels = sorted({row.level for row in measured})
    for name, label, colour, shift in (
        ("odometry_m", "odometry", "#b0632a", -0.05),
        ("slam_m", "SLAM", "#2a6fb0", 0.05),
    ):
        x = [row.level + shift for row in measured]
        left.plot(x, [getattr(row, name) for row in measured], ".", color=colour, alpha=0.5, label=label)
    left.set(xlabel="noise level", ylabel="position error, RMS [m]", yscale="log", xticks=levels)
    left.legend(frameon=False)
    for name, label, colour, shift in (
        ("f1_odometry", "odometry", "#b0632a", -0.08),
        ("f1_slam", "SLAM", "#2a6fb0", 0.0),
        ("f1_truth", "true poses", "#4a8f4a", 0.08),
    ):
        x = [row.level + shift for row in measured]
        right.plot(x, [getattr(row, name) for row in measured], ".", color=colour, alpha=0.5, label=label)
    right.set(xlabel="noise level", ylabel="F1 of walls, 0.1 m", ylim=(0.0, 1.02), xticks=levels)
    right.legend(frameon=False, loc="lower left")
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--families", default=",".join(FAMILIES))
    parser.add_argument("--seeds", default="101,102,103,104,105")
    parser.add_argument("--levels", default="0.5,1,2,3")
    parser.add_argument("--duration", type=float, default=120.0, help="mission time [s]")
    parser.add_argument("--view", type=float, default=360.0, help="angle of the lidar's beams [degrees]")
    parser.add_argument("--range", type=float, default=math.inf, help="greatest range of the lidar [m]")
    parser.add_argument("--component", action="append", default=[], metavar="NAME=VALUE", help="of the noise")
    parser.add_argument("--out", type=Path, default=Path("accuracy"))
    options = parser.parse_args()
    components = tuple((name, float(value)) for name, value in (one.split("=") for one in options.component))
    sensing = Sensing(math.radians(options.view), options.range, components)
    measured = []
    options.out.mkdir(parents=True, exist_ok=True)
    with (options.out / "accuracy.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [each.name for each in fields(Row)])
        writer.writeheader()
        seeds, levels = map(int, options.seeds.split(",")), map(float, options.levels.split(","))
        for row in rows(options.families.split(","), tuple(seeds), tuple(levels), options.duration, sensing):
            writer.writerow(asdict(row))
            file.flush()
            measured.append(row)
    (options.out / "accuracy.png").write_bytes(figure_png(picture(measured)))
    Console(width=80, highlight=False).print(table(measured))


if __name__ == "__main__":
    main()
