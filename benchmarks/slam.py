"""SLAM in ``make bench``: processor time of its steps for each scan, and the peak memory of a process that maps."""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from mapping.io.robot_log_file import load_robot_log, save_robot_log
from mapping.robot.robot_log import RobotLog
from mapping.slam.pipeline import slam
from sim.mission.mission import Mission
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.sensors.lidar_presets import lidar_preset
from sim.sensors.noise import Noise
from sim.sensors.sensing import sense
from worlds.families.registry import make_world

SEED = 7
TIME_BOUND_MS = 3.0
MEMORY_BOUND_MB = 300
DURATIONS = (120.0, 400.0, 1600.0)
"""Time must grow in proportion to the log."""


def bench_slam() -> None:
    """Map a robot's log of two lengths at noise level 1, and measure the memory in a process of its own."""
    table = Table(
        title="SLAM, corridor_loop, 360 beams at 10 Hz", box=box.SIMPLE_HEAD, title_justify="left", pad_edge=False
    )
    table.add_column("duration")
    for name in ("scans", "tracking", "loops", "adjustment", "registration", "ms a scan", "bound"):
        table.add_column(name, justify="right")
    for duration in DURATIONS:
        mission, _ = simulate(make_world("corridor_loop", SEED), MissionSettings(1, duration), SEED)
        log = _log(mission)
        slam(log.part(0, 100))  # compiled functions
        result, scans = slam(log), len(log.scans)
        steps = [1000.0 * seconds / scans for seconds in result.timings.values()]
        cost = (*(f"{step:.2f}" for step in steps), f"{sum(steps):.2f}", f"{TIME_BOUND_MS:g}")
        table.add_row(f"{duration:g} s", str(scans), *cost)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.npz"
        save_robot_log(path, _log(mission))
        command = [sys.executable, "-m", "benchmarks.slam", str(path)]
        memory = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    table.caption = f"peak memory of the process: {memory} MB, bound {MEMORY_BOUND_MB} MB"
    Console(highlight=False).print(table)


def _log(mission: Mission) -> RobotLog:
    noise = Noise.level(1.0, lidar_preset(mission.settings.robots[0].lidar.model).noise)
    return sense(mission.robots[0], noise, SEED, 0).log


def print_memory(path: Path) -> None:
    """Print the peak memory [MB] of a process that maps a log."""
    slam(load_robot_log(path))
    sys.stdout.write(f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0:.0f}\n")


if __name__ == "__main__":
    print_memory(Path(sys.argv[1]))
