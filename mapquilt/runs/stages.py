"""Simulate or sense a mission, and write the run: each stage needs only what the one before left on disk."""

from __future__ import annotations

import dataclasses
import itertools
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from mapping.robot.trajectory import Trajectory
from mapquilt.json_file import read_record
from mapquilt.runs import folder as run_folder
from mapquilt.runs.coverage_file import write_coverage
from mapquilt.runs.sample import Sample, make_sample, sample_steps
from mapquilt.runs.writer import fill_run
from mapquilt.settings import SampleSettings
from merge.merger import Progress
from sim.mission.coverage import coverage
from sim.mission.file import load_mission, save_mission
from sim.mission.mission import Mission
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from worlds.world import World

SimulationProgress = Callable[[float], None]
"""Called with the simulated time [s]."""


def simulate_run(
    out: Path,
    world: World,
    mission_settings: MissionSettings,
    sample_settings: SampleSettings,
    seed: int,
    on_progress: SimulationProgress | None = None,
    replay: Sequence[Trajectory] = (),
    on_mapping: Progress | None = None,
) -> Sample:
    """Simulate a mission, sense and map it, perturb the frames of the maps, and write the run."""
    run_folder.refuse_foreign(out)
    mission, times = simulate(world, mission_settings, seed, on_progress, replay, sample_settings.mapping.clear_range)
    return write_run(out, mission, sample_settings, {"simulate": dataclasses.asdict(times)}, on_mapping)


def sense_run(run: Path, out: Path, settings: SampleSettings, on_mapping: Progress | None = None) -> Mission:
    """Write another run of a stored mission, without simulating it again.

    Raises ``ValueError`` if that would replace the run itself, or files of others.
    """
    run_folder.spare_inputs(out, [run])
    run_folder.refuse_foreign(out)
    mission = load_mission(run_folder.mission_folder(run))
    write_run(out, mission, settings, {}, on_mapping)
    return mission


def write_run(
    out: Path,
    mission: Mission,
    settings: SampleSettings,
    timings: dict[str, dict[str, float]],
    on_progress: Progress | None = None,
) -> Sample:
    """Make the maps of a mission and write the run atomically."""
    step = _counted(on_progress, sample_steps(len(mission.robots), settings.parts) + 1)
    start = time.perf_counter()
    sample = make_sample(mission, settings, on_step=step)
    sampled = time.perf_counter() - start
    with run_folder.new_run(out) as folder:
        save_mission(mission, folder / run_folder.MISSION_FOLDER)
        fill_run(folder, mission, settings, sample)
        write_coverage(folder, coverage(mission, settings.mapping.clear_range))
        step()
        for stage, seconds in timings.items():
            run_folder.add_timings(folder, stage, seconds)
        written = time.perf_counter() - start - sampled
        run_folder.add_timings(folder, "sense", {"sense_and_map": sampled, "write": written})
    return sample


def _counted(on_progress: Progress | None, total: int) -> Callable[[], None]:
    """Report zero steps now, and one more step at each call of the result."""
    counter = itertools.count()

    def step() -> None:
        if on_progress is not None:
            on_progress(next(counter), total)

    step()
    return step


def run_seed(run: Path) -> int:
    """Return the seed of a run's noise and frame perturbations."""
    return int(read_record(run_folder.require_run(run) / run_folder.RUN_FILE, "run")["sample_seed"])
