"""Acceptance tests of loops, each switched off in turn, where places look alike and odometry is bad.

``python -m benchmarks.loop_tests --out loops`` writes loops.csv, one row for each run and variant, and prints sums for
each world. The lidar sees 3.5 m and has noise level 1; the odometry has that of ``--levels``. ``--log FILE`` adds the
scans of a real log with reference poses, and odometry simulated on these poses.
"""

from __future__ import annotations

import argparse
import csv
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from benchmarks.alike_worlds import WORLDS, drive
from mapping.geometry.se2 import SE2
from mapping.robot.robot_log import RobotLog
from mapping.robot.trajectory import Trajectory
from mapping.seeds import Role, stream
from mapping.slam.pipeline import slam
from mapping.slam.result import SlamResult
from mapping.slam.settings import LoopSettings, SlamSettings
from mapquilt.evaluation.trajectory_error import absolute_error
from mapquilt.logs.load_log import LogSource, load_log
from mapquilt.viz.text_table import plain_table
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.physics.robot import RobotSettings
from sim.sensors.lidar_presets import lidar_preset
from sim.sensors.noise import Noise
from sim.sensors.odometry import OdometryNoise, draw_bias, simulate_odometry
from sim.sensors.sensing import sense

LIDAR = lidar_preset("lds01")

FALSE_SHIFT, FALSE_TURN = 0.5, 0.1
"""A loop is false if it errs by more [m, rad]."""

HEADER = ("world", "tests", "loops", "false", "error m", "largest")

OFF: dict[str, dict[str, Any]] = {
    "all tests": {},
    "no overlap": {"min_submap_overlap": 0.0},
    "no agreement": {"min_agreement": 0.0},
    "no runner-up": {"max_runner_up": 1e9},
    "no position deviation": {"max_position_deviation": 1e9},
    "no chi-squared": {"greatest_chi_squared": 1e9},
    "no test": {
        "min_submap_overlap": 0.0,
        "min_agreement": 0.0,
        "max_runner_up": 1e9,
        "max_position_deviation": 1e9,
        "greatest_chi_squared": 1e9,
    },
}


@dataclass(frozen=True)
class Row:
    """Loops of one run with a variant of the tests: number, false ones, and root mean square error of position [m]."""

    world: str
    seed: int
    level: float
    variant: str
    loops: int
    false: int
    slam_m: float


Case = tuple[str, int, float, RobotLog, Trajectory]
"""World or log, seed, noise level of the odometry, what the robot sensed, and its true poses."""


def simulated(worlds: Sequence[str], seeds: Sequence[int], levels: Sequence[float], rounds: int) -> Iterator[Case]:
    """Drive through each world once for each seed, and sense that at each level."""
    robot = RobotSettings(lidar=LIDAR.lidar)
    for name in worlds:
        for seed in seeds:
            world, route = WORLDS[name](np.random.default_rng(seed))
            path = drive(route, rounds, robot.limits.speed, robot.limits.turn_rate, LIDAR.lidar.rate)
            settings = MissionSettings((robot,), float(path.stamps[-1]), policy="replay")
            truth = simulate(world, settings, seed, replay=(path,))[0].robots[0]
            for level in levels:
                noise = replace(Noise.level(1.0, LIDAR.noise), odometry=OdometryNoise().scaled(level))
                yield name, seed, level, sense(truth, noise, seed, 0).log, truth.trajectory


def recorded(path: Path, seeds: Sequence[int], levels: Sequence[float]) -> Iterator[Case]:
    """Simulate odometry on the reference poses of a real log."""
    (named,) = load_log(path, LogSource())
    log, true = named.recorded.log, named.recorded.reference
    if true is None:
        raise SystemExit(f"--log {path}: it has no reference poses")
    for seed in seeds:
        for level in levels:
            noise = OdometryNoise().scaled(level)
            bias = draw_bias(noise, stream(seed, Role.ODOMETRY_BIAS, 0))
            odometry = simulate_odometry(true, noise, bias, stream(seed, Role.ODOMETRY_NOISE, 0))
            yield named.name, seed, level, replace(log, odometry=odometry), true


def rows(cases: Iterable[Case]) -> Iterator[Row]:
    """Map each case with each variant of the tests."""
    variants = {name: LoopSettings(**changes) for name, changes in OFF.items()}
    variants["no loops"] = LoopSettings(enabled=False)
    for name, seed, level, log, true in cases:
        for variant, loops in variants.items():
            result = slam(log, replace(SlamSettings(), loops=loops))
            error = math.sqrt(float(np.mean(absolute_error(result.trajectory, true).position ** 2)))
            yield Row(name, seed, level, variant, len(result.loops), count_false(result, true), error)


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
    parser.add_argument("--worlds", default=",".join(WORLDS))
    parser.add_argument("--seeds", default="201,202")
    parser.add_argument("--levels", default="5,10")
    parser.add_argument("--rounds", type=int, default=2, help="number of times that the robot drives its route")
    parser.add_argument("--log", type=Path, action="append", default=[], help="a real log with reference poses")
    parser.add_argument("--out", type=Path, default=Path("loops"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    measured = []
    with (options.out / "loops.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [each.name for each in fields(Row)])
        writer.writeheader()
        seeds = tuple(map(int, options.seeds.split(",")))
        levels = tuple(map(float, options.levels.split(",")))
        worlds = [name for name in options.worlds.split(",") if name]
        logs = (recorded(path, seeds, levels) for path in options.log)
        for row in rows(chain(simulated(worlds, seeds, levels, options.rounds), *logs)):
            writer.writerow(asdict(row))
            file.flush()
            measured.append(row)
    shown = plain_table(*((name, name not in ("world", "tests")) for name in HEADER))
    for world, variant in dict.fromkeys((row.world, row.variant) for row in measured):
        part = [row for row in measured if (row.world, row.variant) == (world, variant)]
        errors = [row.slam_m for row in part]
        totals = (sum(row.loops for row in part), sum(row.false for row in part))
        shown.add_row(world, variant, *map(str, totals), f"{np.mean(errors):.3f}", f"{max(errors):.3f}")
    Console(width=80, highlight=False).print(shown)


if __name__ == "__main__":
    main()
