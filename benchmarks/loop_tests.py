"""Acceptance tests of loops, each switched off in turn, where rooms look alike and odometry is bad.

``python -m benchmarks.loop_tests --out loops`` writes loops.csv, one row for each robot and variant, and prints sums.
The lidar sees 3.5 m and has noise level 1; the odometry that of ``--levels``.
"""

from __future__ import annotations

import argparse
import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from mapping.geometry.se2 import SE2
from mapping.robot.trajectory import Trajectory
from mapping.slam.pipeline import slam
from mapping.slam.result import SlamResult
from mapping.slam.settings import LoopSettings, SlamSettings
from mapquilt.evaluation.trajectory_error import absolute_error
from mapquilt.runs.open_world import open_world
from mapquilt.viz.text_table import plain_table
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.physics.robot import RobotSettings
from sim.sensors.lidar_presets import lidar_preset
from sim.sensors.noise import Noise
from sim.sensors.odometry import OdometryNoise
from sim.sensors.sensing import sense

LIDAR = lidar_preset("lds01")

FALSE_SHIFT, FALSE_TURN = 0.5, 0.1
"""A loop is false if it errs by more [m, rad]."""

OFF: dict[str, dict[str, Any]] = {
    "all tests": {},
    "no overlap": {"min_submap_overlap": 0.0},
    "no likelihood": {"min_likelihood": 0.0},
    "no agreement": {"min_agreement": 0.0},
    "no runner-up": {"max_runner_up": 1e9},
    "no Mahalanobis": {"max_mahalanobis_squared": 1e9},
    "no test": {
        "min_submap_overlap": 0.0,
        "min_likelihood": 0.0,
        "min_agreement": 0.0,
        "max_runner_up": 1e9,
        "max_mahalanobis_squared": 1e9,
        "max_position_deviation": 1e9,
        "greatest_chi_squared": 1e9,
    },
}


@dataclass(frozen=True)
class Row:
    """Loops of one robot with a variant of the tests: number, false ones, and position error [m] with and without
    loops."""

    world: str
    seed: int
    robot: int
    level: float
    variant: str
    loops: int
    false: int
    slam_m: float


def rows(worlds: Sequence[str], seeds: Sequence[int], levels: Sequence[float], duration: float) -> Iterator[Row]:
    """Simulate each mission once, and map it with each variant."""
    variants = {name: LoopSettings(**changes) for name, changes in OFF.items()}
    variants["no loops"] = LoopSettings(enabled=False)
    for name in worlds:
        for seed in seeds:
            world, _ = open_world(name, seed)
            mission, _ = simulate(world, MissionSettings((RobotSettings(lidar=LIDAR.lidar),) * 2, duration), seed)
            for level in levels:
                noise = replace(Noise.level(1.0, LIDAR.noise), odometry=OdometryNoise().scaled(level))
                for robot, truth in enumerate(mission.robots):
                    log = sense(truth, noise, seed, robot).log
                    for variant, loops in variants.items():
                        result = slam(log, replace(SlamSettings(), loops=loops))
                        error = absolute_error(result.trajectory, truth.trajectory)
                        rmse = math.sqrt(float(np.mean(error.position**2)))
                        false = count_false(result, truth.trajectory)
                        yield Row(name, seed, robot, level, variant, len(result.loops), false, rmse)


def count_false(result: SlamResult, true: Trajectory) -> int:
    """Count the loops that are not where the robot truly was."""
    count = 0
    for edge in result.loops:
        first, second = (true.pose(int(result.keyframes[k])) for k in (edge.first, edge.second))
        off: SE2 = (first.inverse() @ second).inverse() @ edge.first_from_second
        count += math.hypot(off.x, off.y) > FALSE_SHIFT or abs(off.yaw) > FALSE_TURN
    return count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--worlds", default="hospital,office")
    parser.add_argument("--seeds", default="201")
    parser.add_argument("--levels", default="5,10")
    parser.add_argument("--duration", type=float, default=240.0, help="mission time [s]")
    parser.add_argument("--out", type=Path, default=Path("loops"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    measured = []
    with (options.out / "loops.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [each.name for each in fields(Row)])
        writer.writeheader()
        seeds, levels = map(int, options.seeds.split(",")), map(float, options.levels.split(","))
        for row in rows(options.worlds.split(","), tuple(seeds), tuple(levels), options.duration):
            writer.writerow(asdict(row))
            file.flush()
            measured.append(row)
    shown = plain_table(*((name, name != "tests") for name in ("tests", "loops", "false", "error m", "max")))
    for variant in dict.fromkeys(row.variant for row in measured):
        part = [row for row in measured if row.variant == variant]
        errors = [row.slam_m for row in part]
        totals = (sum(row.loops for row in part), sum(row.false for row in part))
        shown.add_row(variant, *map(str, totals), f"{np.mean(errors):.3f}", f"{max(errors):.3f}")
    Console(width=80, highlight=False).print(shown)


if __name__ == "__main__":
    main()
