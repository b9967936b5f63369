"""Measure the cost of each step (``make bench``), as ratios within one run: absolute times depend on the machine."""

from __future__ import annotations

import math
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from benchmarks.dataset import bench_dataset
from benchmarks.particle import bench_particle_filter
from benchmarks.simulation import bench_simulation
from benchmarks.slam import bench_slam
from benchmarks.thesis import bench_thesis
from mapping.geometry.se2 import SE2
from mapping.grid.log_odds import LogOddsMapper
from mapping.robot.scan import LidarScan
from mapquilt.merging.merge_folder import merge_run
from mapquilt.runs import folder as run_folder
from mapquilt.runs.stages import simulate_run
from mapquilt.scoring.score_file import score_run
from mapquilt.settings import SampleSettings
from merge.settings import MergeSettings
from sim.mission.file import load_mission
from sim.mission.mission import Mission
from sim.mission.settings import MissionSettings
from sim.physics.bodies import RAY_HEIGHT
from sim.physics.bullet import BulletScene
from worlds.families.registry import make_world

SEED = 7
DURATION = 120.0
MAPPING_BOUND = 0.4
SITE_SIDE = 250.0
SITE_SCANS = 1_000_000
SITE_LANES = 25
SITE_BOUND_MB = 2048


def main(arguments: list[str]) -> None:
    """Print the tables; ``--site`` maps a large site instead, and prints its peak memory."""
    if arguments == ["--site"]:
        print_site_memory()
        return
    with tempfile.TemporaryDirectory() as folder:
        mission = bench_main_job(Path(folder) / "run")
    bench_mapping(mission)
    bench_particle_filter(mission)
    bench_slam()
    bench_simulation()
    bench_thesis()
    bench_dataset()
    bench_site()


def bench_main_job(run: Path) -> Mission:
    """Split the time of a simulated run into physics, rays, planning, mapping and merging."""
    settings = SampleSettings(seed=SEED)
    simulate_run(run, make_world("office", SEED), MissionSettings(duration=DURATION), settings, SEED)
    merge_run(run, MergeSettings(), seed=0)
    score_run(run)
    timings = run_folder.read_timings(run)
    table = _table(f"main job: office, 3 robots, {DURATION:g} s, 360 beams at 10 Hz, 5 cm", "stage", "s", "share")
    steps = {
        f"{stage}: {step}": seconds
        for stage, parts in timings.items()
        for step, seconds in parts.items()
        if step != "total"
    }
    whole = sum(steps.values())
    for name, seconds in steps.items():
        table.add_row(name, f"{seconds:.2f}", f"{100 * seconds / whole:.0f} %")
    table.add_row("all", f"{whole:.2f}", "100 %")
    simulated = timings["simulate"]["total"]
    table.caption = f"simulating runs at {DURATION / simulated:.0f} times real time"
    _print(table)
    return load_mission(run_folder.mission_folder(run))


def bench_mapping(mission: Mission) -> None:
    """Compare the integration of a scan with the ray casting that makes it, in turn, on every scan of one robot."""
    robot, lidar = mission.robots[0], mission.settings.robots[0].lidar
    poses = [robot.trajectory.pose(k) @ robot.base_from_lidar for k in range(len(robot.scans))]
    with BulletScene(mission.world, []) as scene:
        rays = [_rays(pose, lidar.angles, lidar.range_max) for pose in poses]

        def cast() -> None:
            for start, end in rays:
                scene.rays(start, end)

        ratios = [_seconds(lambda: _integrate(robot.scans, poses)) / _seconds(cast) for _ in range(7)]
    table = _table(
        "integrating a scan, as a share of the bare rayTestBatch call for it", "", "median", "range", "bound"
    )
    span = f"{min(ratios):.2f} to {max(ratios):.2f}"
    table.add_row("360 beams, 12 m, 5 cm", f"{statistics.median(ratios):.2f}", span, f"{MAPPING_BOUND:g}")
    _print(table)


def _rays(pose: SE2, angles: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    ways = np.stack((np.cos(pose.yaw + angles), np.sin(pose.yaw + angles), np.zeros(angles.size)), axis=-1)
    start = np.repeat([[pose.x, pose.y, RAY_HEIGHT]], angles.size, axis=0)
    return start, start + reach * ways


def _integrate(scans: tuple[LidarScan, ...], poses: list[SE2]) -> None:
    mapper = LogOddsMapper()
    for scan, pose in zip(scans, poses, strict=True):
        mapper.integrate(scan, pose)


def bench_site() -> None:
    """Map a large site in a separate process, to measure its peak memory."""
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.bench", "--site"], check=True, capture_output=True, text=True
    )
    table = _table("peak memory of mapping a site", "", "MB", "bound")
    name = f"{SITE_SIDE:g} x {SITE_SIDE:g} m, {SITE_SCANS:,} scans of 36 beams, 5 cm"
    table.add_row(name, done.stdout.strip(), f"{SITE_BOUND_MB}")
    _print(table)


def print_site_memory() -> None:
    """Map the site lane by lane, with few beams, since memory depends on the area only."""
    rng = np.random.default_rng(SEED)
    mapper = LogOddsMapper()
    beams = 36
    for k in range(SITE_SCANS):
        lane, along = divmod(k / SITE_SCANS * SITE_LANES, 1.0)
        inside = SITE_SIDE - 24.0
        pose = SE2(12.0 + inside * along, 12.0 + inside * lane / (SITE_LANES - 1), 0.001 * k)
        ranges = rng.uniform(2.0, 12.0, beams).astype(np.float32)
        mapper.integrate(LidarScan(0.1 * k, -math.pi, math.tau / beams, 0.1, 12.0, ranges), pose)
    mapper.grid()
    sys.stdout.write(f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f}\n")


def _seconds(work: Callable[[], None]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, box=box.SIMPLE_HEAD, title_justify="left", pad_edge=False, caption_justify="left")
    for index, column in enumerate(columns):
        table.add_column(column, justify="right" if index else "left")
    return table


def _print(table: Table) -> None:
    Console(highlight=False).print(table)


if __name__ == "__main__":
    main(sys.argv[1:])
