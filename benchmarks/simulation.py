"""Simulation in ``make bench``, compared with bare PyBullet calls, real time, and another simulator."""

from __future__ import annotations

import importlib
import logging
import math
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from rich import box
from rich.console import Console
from rich.table import Table

from mapping.geometry.se2 import SE2
from sim.mission.mission import Mission
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.physics.bodies import RAY_HEIGHT
from sim.physics.bullet import SHORT_REACH, BulletScene
from sim.physics.drive import Drive
from sim.sensors.lidar import Lidar
from worlds.families.registry import make_world
from worlds.world import World

SEED = 7
ROUNDS = 5
REPLAYED = 30.0
REPLAY_BOUND, RAYS_BOUND, MEMORY_BOUND_MB = 1.5, 4.0, 400
REAL_TIME: tuple[tuple[str, int, Drive, float, float], ...] = (
    ("exploring: 3 robots", 3, "velocity", 120.0, 15.0),
    ("on wheels: 8 robots", 8, "wheels", 60.0, 3.0),
)
"""Name, number of robots, drive, duration [s], least real-time factor on one core."""

Rays = tuple[np.ndarray, np.ndarray]


def bench_simulation() -> None:
    """Print the cost of the simulation, in processor time of one process."""
    table = _table("simulating: office, 360 beams at 10 Hz, 12 m", "", "measured", "range", "bound")
    _add_replay(table)
    for name, robots, drive, duration, bound in REAL_TIME:
        settings = MissionSettings(robots, duration, drive=drive)
        taken = _seconds(partial(simulate, make_world("office", SEED), settings, SEED))
        table.add_row(f"{name}, times real time", f"{duration / taken:.1f}", "", f"at least {bound:g}")
    _add_rays(table)
    _add_memory(table)
    Console(highlight=False, width=110).print(table)


def _add_replay(table: Table) -> None:
    world = make_world("office", SEED)
    mission, _ = simulate(world, MissionSettings(duration=REPLAYED), SEED)
    paths = tuple(truth.trajectory for truth in mission.robots)
    settings = MissionSettings(duration=REPLAYED, policy="replay")
    simulate(world, MissionSettings(duration=1.0, policy="replay"), SEED, replay=paths)
    rays = _needed_rays(mission)
    ratios = [
        _seconds(lambda: simulate(world, settings, SEED, replay=paths)) / _seconds(lambda: _bare(mission, rays))
        for _ in range(ROUNDS)
    ]
    _add_ratios(table, "a replayed mission over its bare PyBullet calls", ratios, f"at most {REPLAY_BOUND:g}")


def _needed_rays(mission: Mission) -> list[list[list[Rays]]]:
    """List the rays of each scan of each robot: all beams at short range, and those without a hit at full range."""
    lidar = mission.settings.robots[0].lidar
    needed = []
    for truth in mission.robots:
        scans = []
        for k, scan in enumerate(truth.scans):
            pose = truth.trajectory.pose(k) @ truth.base_from_lidar
            far = scan.ranges > SHORT_REACH
            scans.append([_rays(pose, lidar.angles, SHORT_REACH), _rays(pose, lidar.angles[far], lidar.range_max)])
        needed.append(scans)
    return needed


def _rays(pose: SE2, angles: np.ndarray, reach: float) -> Rays:
    ways = np.stack((np.cos(pose.yaw + angles), np.sin(pose.yaw + angles), np.zeros(angles.size)), axis=-1)
    start = np.repeat([[pose.x, pose.y, RAY_HEIGHT]], angles.size, axis=0)
    return start, start + reach * ways


def _bare(mission: Mission, rays: list[list[list[Rays]]]) -> None:
    """Run only the steps and rays of the mission in the same scene."""
    starts = [truth.trajectory.pose(0) for truth in mission.robots]
    with BulletScene(mission.world, starts, mission.settings.robots) as scene:
        for k in range(len(mission.robots[0].scans)):
            scene.set_poses([truth.trajectory.pose(k) for truth in mission.robots])
            for robot in range(len(mission.robots)):
                for start, end in rays[robot][k]:
                    scene.rays(start, end, ignored=2 << robot)


def _add_rays(table: Table) -> None:
    name = "rays a second over those of ir-sim"
    try:
        logging.disable(logging.CRITICAL)
        irsim = importlib.import_module("irsim")
    except ImportError:
        table.add_row(name, "-", "needs `.venv/bin/pip install -e '.[bench]'`", f"at least {RAYS_BOUND:g}")
        return
    finally:
        logging.disable(logging.NOTSET)
    world, lidar = make_world("office", SEED), Lidar()
    mission, _ = simulate(world, MissionSettings(duration=0.1), SEED)
    starts = [truth.trajectory.pose(0) for truth in mission.robots]
    with tempfile.TemporaryDirectory() as folder, BulletScene(world, starts) as scene:
        theirs = _ir_sim(irsim, Path(folder) / "world.yaml", world, starts, lidar)
        ratios = [
            _seconds(lambda: [robot.lidar.step(robot.state) for _ in range(10) for robot in theirs])
            / _seconds(lambda: [scene.cast(robot, lidar) for _ in range(10) for robot in range(len(starts))])
            for _ in range(ROUNDS)
        ]
    _add_ratios(table, f"{name} {irsim.__version__}", ratios, f"at least {RAYS_BOUND:g}")


def _ir_sim(irsim: Any, path: Path, world: World, starts: list[SE2], lidar: Lidar) -> Any:
    """Create the robots of an ir-sim world with the same walls, beams and starts."""
    sensor = {
        "name": "lidar2d",
        "range_max": lidar.range_max,
        "angle_range": math.tau,
        "number": lidar.beams,
        "noise": False,
    }
    record = {
        "world": {"width": world.size[0], "height": world.size[1], "step_time": 0.1},
        "robot": [
            {
                "kinematics": {"name": "diff"},
                "shape": {"name": "circle", "radius": 0.2},
                "state": [start.x, start.y, start.yaw],
                "sensors": [dict(sensor)],
            }
            for start in starts
        ],
        "obstacle": [
            {"shape": {"name": "polygon", "vertices": solid.tolist()}, "state": [0, 0, 0]} for solid in world.obstacles
        ],
    }
    path.write_text(yaml.safe_dump(record), encoding="utf-8")
    return irsim.make(str(path), display=False, save_ani=False, log_level="ERROR").robot_list


def _add_memory(table: Table) -> None:
    program = [sys.executable, "-m", "benchmarks.simulation"]
    done = subprocess.run(program, check=True, capture_output=True, text=True)
    table.add_row(
        "peak memory of a process that simulates 3 robots [MB]", done.stdout.strip(), "", f"below {MEMORY_BOUND_MB}"
    )


def print_memory() -> None:
    """Simulate a mission in this process, and print its peak memory [MB]."""
    simulate(make_world("office", SEED), MissionSettings(duration=120.0), SEED)
    sys.stdout.write(f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f}\n")


def _add_ratios(table: Table, name: str, ratios: list[float], bound: str) -> None:
    table.add_row(name, f"{statistics.median(ratios):.2f}", f"{min(ratios):.2f} to {max(ratios):.2f}", bound)


def _seconds(work: Callable[[], object]) -> float:
    """Measure processor time, which depends little on other processes."""
    start = time.process_time()
    work()
    return time.process_time() - start


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, box=box.SIMPLE_HEAD, title_justify="left", pad_edge=False)
    for index, column in enumerate(columns):
        table.add_column(column, justify="right" if index else "left")
    return table


if __name__ == "__main__":
    print_memory()
