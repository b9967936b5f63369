"""Particle filter in ``make bench``: time for each scan, and memory of the particles' maps."""

from __future__ import annotations

import time

from rich import box
from rich.console import Console
from rich.table import Table

from mapping.particle.filter import particle_filter
from sim.mission.mission import Mission
from sim.sensors.lidar_presets import lidar_preset
from sim.sensors.noise import Noise
from sim.sensors.sensing import sense

SEED = 7
TIME_BOUND_MS = 6
MEMORY_BOUND_MB = 150


def bench_particle_filter(mission: Mission) -> None:
    """Filter the log of each robot at noise level 1, with compiled functions."""
    noise = Noise.level(1.0, lidar_preset(mission.settings.robots[0].lidar.model).noise)
    logs = [sense(truth, noise, SEED, index).log for index, truth in enumerate(mission.robots)]
    particle_filter(logs[0].part(0, 50))
    table = Table(
        title="particle filter, 30 particles, 5 cm", box=box.SIMPLE_HEAD, title_justify="left", pad_edge=False
    )
    table.add_column("robot")
    for name in ("scans", "updates", "ms a scan", "bound", "maps MB", "bound"):
        table.add_column(name, justify="right")
    for index, log in enumerate(logs):
        start = time.process_time()
        result = particle_filter(log)
        milliseconds = 1000.0 * (time.process_time() - start) / len(log.scans)
        cost = (f"{milliseconds:.1f}", f"{TIME_BOUND_MS}", f"{result.map_bytes / 1e6:.0f}", f"{MEMORY_BOUND_MB}")
        table.add_row(f"robot_{index}", str(len(log.scans)), str(len(result.updates)), *cost)
    Console(highlight=False).print(table)
