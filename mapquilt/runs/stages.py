"""Stages of a run: simulate, sense and score; each reads the files of the stage before."""

from __future__ import annotations

import dataclasses
import itertools
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.atomic import write_files_atomically
from mapping.io.map_file import load_map
from mapping.map_set import MapSet
from mapping.robot.trajectory import Trajectory
from mapquilt.evaluation.evaluated_pair import PairInfo
from mapquilt.evaluation.run_score import RunScore, evaluate_run_pair, score_bytes, score_merged_map
from mapquilt.json_file import read_record
from mapquilt.merging.merge_file import GroupRecord, MergeAnswer, load_answer
from mapquilt.runs import folder as run_folder
from mapquilt.runs.coverage_file import write_coverage
from mapquilt.runs.sample import Sample, make_sample, sample_steps
from mapquilt.runs.truth_file import RunTruth, load_truth
from mapquilt.runs.writer import fill_run
from mapquilt.settings import SampleSettings
from mapquilt.viz.png import figure_png
from merge.merger import Progress
from merge.records.result import PairResult
from sim.mission.coverage import coverage
from sim.mission.file import load_mission, save_mission
from sim.mission.mission import Mission, simulate
from sim.mission.settings import MissionSettings
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
    """Write another run of a stored mission, without simulating it again."""
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


def score_run(run: Path) -> RunScore:
    """Evaluate a run's merge against its truth, and write score.json and overview.png, both or neither."""
    from mapquilt.viz.overview import overview_figure

    maps, timings = run_folder.load_maps(run), run_folder.read_timings(run)
    merge_path = run / run_folder.MERGE_FILE
    if not merge_path.exists():
        raise ValueError(f"{merge_path}: no such file; run `mapquilt merge {run}` first")
    answer, truth = load_answer(merge_path), load_truth(run / run_folder.TRUTH_FILE)
    answer = answer.without_added()
    _check_of_one_run(run, maps, answer, truth)
    start = time.perf_counter()
    groups = _merged_groups(run, answer)
    world, footprints = run_folder.true_rasters(run, maps)
    merged = tuple(
        score_merged_map(
            maps=maps,
            truth=truth,
            reference_from_map=group.reference_from_map,
            reference=group.reference,
            merged=grid,
            world=world,
            footprints={name: footprints[name] for name in group.reference_from_map},
        )
        for group, grid in groups
    )
    pairs = tuple(evaluate_run_pair(maps, truth, pair, _info(pair), answer.method) for pair in answer.pairs)
    score = RunScore(pairs, merged)
    scored = time.perf_counter() - start
    mission = load_mission(run_folder.mission_folder(run))
    figure = overview_figure(mission, maps, truth, groups, score)
    score_path = run / run_folder.SCORE_FILE
    files = {score_path: score_bytes(score_path, score), run / run_folder.OVERVIEW_PICTURE: figure_png(figure)}
    seconds = {"score": scored, "draw": time.perf_counter() - start - scored}
    write_files_atomically(files | run_folder.timings_file(run, timings, "score", seconds))
    return score


def _info(pair: PairResult) -> PairInfo:
    return PairInfo(f"{pair.target} and {pair.source}", pair.target, pair.source)


def _merged_groups(run: Path, answer: MergeAnswer) -> list[tuple[GroupRecord, OccupancyGrid]]:
    """Load the merged map of each group that has one."""
    return [
        (group, load_map(run / f"{group.merged}.yaml").grid)
        for group in answer.groups
        if group.merged is not None and group.reference_from_map
    ]


def _check_of_one_run(run: Path, maps: MapSet, answer: MergeAnswer, truth: RunTruth) -> None:
    known = [robot.name for robot in truth.robots]
    for name in maps.names:
        if known.count(name) != 1:
            raise ValueError(
                f"{run / run_folder.TRUTH_FILE}: has the map {name!r} {known.count(name)} times, must be once"
            )
    for name in (
        *({answer.reference} - answer.added),
        *answer.reference_from_map,
        *(n for p in answer.pairs for n in (p.target, p.source)),
    ):
        if name not in maps.names:
            raise ValueError(f"{run / run_folder.MERGE_FILE}: names a map {name[:100]!r} that the run does not have")
    for pair in answer.pairs:
        if (pair.target, pair.source) not in truth.pairs:
            raise ValueError(f"{run / run_folder.TRUTH_FILE}: has no pair {pair.target}, {pair.source}")


def run_seed(run: Path) -> int:
    """Return the seed of a run's noise and frame perturbations."""
    return int(read_record(run_folder.require_run(run) / run_folder.RUN_FILE, "run")["sample_seed"])
