"""Consistency of the edges of SLAM: their mean normalised squared error against the true poses.

``python -m benchmarks.edge_consistency --families office,cave --seeds 101 --levels 1,3 --log fhw.log.gz`` prints one
line for each run, and a column for edges over so many keyframes. 1 is exact, less is too careful. Squared errors are
divided by 3, the number of parameters, and cut at 50.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from rich.console import Console

from benchmarks.loop_tests import Case, recorded
from mapping.robot.trajectory import Trajectory
from mapping.slam.pipeline import slam
from mapping.slam.result import SlamResult
from mapquilt.runs.open_world import open_world
from mapquilt.viz.text_table import plain_table
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.sensors.lidar_presets import lidar_preset
from sim.sensors.noise import Noise
from sim.sensors.sensing import sense

SPANS = (1, 5, 10, 19)
"""Numbers of keyframes that the links of the track span."""
LOOPS = "loops"
LARGEST = 50.0


def missions(families: list[str], seeds: list[int], levels: list[float]) -> Iterator[Case]:
    """Simulate a mission of 120 s in each world, and sense it at each level of noise."""
    for family in families:
        for seed in seeds:
            mission, _ = simulate(open_world(family, seed)[0], MissionSettings(1, 120.0), seed)
            lidar = lidar_preset(mission.settings.robots[0].lidar.model)
            for level in levels:
                log = sense(mission.robots[0], Noise.level(level, lidar.noise), seed, 0).log
                yield family, seed, level, log, mission.robots[0].trajectory


def consistency(result: SlamResult, true: Trajectory) -> dict[int | str, float]:
    """Return the mean normalised squared error of the edges, by their span."""
    found: dict[int | str, list[float]] = {}
    for edge in result.edges:
        first, second = (true.pose(int(result.keyframes[k])) for k in (edge.first, edge.second))
        error = (first.inverse() @ second @ edge.first_from_second.inverse()).log()
        squared = float(error @ np.linalg.solve(edge.covariance, error)) / 3.0
        found.setdefault(LOOPS if edge.loop else edge.second - edge.first, []).append(min(squared, LARGEST))
    return {span: float(np.mean(errors)) for span, errors in found.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--families", default="office,cave,hospital,open_hall")
    parser.add_argument("--seeds", default="101")
    parser.add_argument("--levels", default="1,3")
    parser.add_argument("--log", type=Path, action="append", default=[], help="a real log with reference poses")
    options = parser.parse_args()
    seeds, levels = (
        [int(text) for text in options.seeds.split(",")],
        [float(text) for text in options.levels.split(",")],
    )
    families = [name for name in options.families.split(",") if name]
    shown = plain_table(("run", False), ("noise", True), *((str(span), True) for span in (*SPANS, LOOPS)))
    logs = (recorded(path, seeds, levels) for path in options.log)
    for name, seed, level, log, true in chain(missions(families, seeds, levels), *logs):
        found = consistency(slam(log), true)
        values = (f"{found[span]:.2f}" if span in found else "-" for span in (*SPANS, LOOPS))
        shown.add_row(f"{name}, {seed}", f"{level:g}", *values)
    Console(width=80, highlight=False).print(shown)


if __name__ == "__main__":
    main()
