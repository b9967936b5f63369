"""One mission of a study: sensed at every level, merged by every method, evaluated against the truth."""

from __future__ import annotations

import time
import warnings
from pathlib import Path

from mapping.io.map_file import map_files
from mapping.map_set import MapSet
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, PairInfo
from mapquilt.jobs.timing import one_thread, warm_up
from mapquilt.runs.sample import Sample, make_sample
from mapquilt.runs.true_footprints import ObservedSlices, TrueFootprints, true_footprints
from mapquilt.scoring.run_score import evaluate_run_pair, score_merged_map
from mapquilt.settings import ExperimentConfig
from mapquilt.study.missions import cut_mission, largest_mission
from mapquilt.study.plan import Level, Method, MissionTask
from mapquilt.study.records import MAPS_FOLDER, Failure, MissionTrials, TeamTrial
from merge.merger import merge_maps
from sim.mission.mission import Mission


def run_mission(task: MissionTask) -> MissionTrials:
    """Run one mission; apart from times, the result depends on the task alone.

    A mission that cannot be simulated or mapped is recorded as a failure.
    """
    trials = MissionTrials()
    with one_thread(), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        for method in task.methods:
            warm_up(ExperimentConfig().merge_by(method.name, method.as_published))
        _run(task, trials)
    trials.warnings = [str(one.message) for one in caught if one.category is UserWarning]
    return trials


def _run(task: MissionTask, trials: MissionTrials) -> None:
    by_drive: dict[ExperimentConfig, list[ExperimentConfig]] = {}
    for _, setup in task.levels:
        by_drive.setdefault(setup.simulated_part(), []).append(setup)
    missions: dict[ExperimentConfig, Mission] = {}
    places: dict[ExperimentConfig, tuple[Mission, TrueFootprints]] = {}
    samples: dict[ExperimentConfig, Sample] = {}
    for number, (level, setup) in enumerate(task.levels):
        drive, place, maps = setup.simulated_part(), setup.observed_part(), setup.mapped_part()
        try:
            if drive not in missions:
                missions[drive] = largest_mission(task.world, task.seed, by_drive[drive], task.cache)
            if place not in places:
                cut = cut_mission(missions[drive], setup)
                seen = ObservedSlices(cut, (setup.parts,), setup.mapping.clear_range)
                places[place] = cut, true_footprints(cut, setup.parts, seen)
            if maps not in samples:
                samples = {maps: make_sample(places[place][0], setup.sample(task.sample_seed), places[place][1])}
        except ValueError as error:
            trials.failures.append(Failure(task.name, level, str(error)))
            continue
        folder = f"{task.name}/{number:02d}"
        trials.files.update(_map_bytes(folder, samples[maps].maps))
        for method in task.methods:
            team, pairs = _merge(task, samples[maps], folder, level, setup, method)
            trials.teams.append(team)
            trials.pairs.extend(pairs)


def _map_bytes(folder: str, maps: MapSet) -> dict[str, bytes]:
    files = {}
    for name, grid in zip(maps.names, maps.grids, strict=True):
        for path, data in map_files(grid, Path(folder) / name, picture="png").items():
            files[path.as_posix()] = data
    return files


def _merge(
    task: MissionTask, sample: Sample, folder: str, level: Level, setup: ExperimentConfig, method: Method
) -> tuple[TeamTrial, list[EvaluatedPair]]:
    """Merge a sample by one method, and evaluate the merged map and every pair of two robots."""
    start = time.process_time()
    result = merge_maps(sample.maps, setup.merge_by(method.name, method.as_published), task.sample_seed)
    seconds = time.process_time() - start
    world = setup.world.family or task.world
    score = score_merged_map(
        maps=sample.maps,
        truth=sample.truth,
        reference_from_map=result.reference_from_map,
        reference=result.reference,
        merged=result.merged,
        world=sample.places.world,
        footprints={place.name: place.footprint for place in sample.places.maps},
    )
    team = TeamTrial(
        mission=task.name,
        world=world,
        level=level,
        method=method.title,
        maps=len(sample.maps),
        joined=len(result.reference_from_map),
        iou_free=score.quality.iou_free,
        f1_walls=score.quality.f1_walls,
        pairs=len(result.pairs),
        seconds=seconds,
    )
    robot = {place.name: place.robot for place in sample.places.maps}
    pairs = [pair for pair in result.pairs if robot[pair.target] != robot[pair.source]]
    return team, [
        evaluate_run_pair(
            sample.maps,
            sample.truth,
            pair,
            PairInfo(
                name=f"{task.name}: {pair.target} and {pair.source}",
                target=pair.target,
                source=pair.source,
                world=world,
                noise=setup.sensing.noise,
                poses=setup.mapping.pose_source,
                mission=task.name,
                level=level,
                target_file=Path(MAPS_FOLDER) / folder / f"{pair.target}.yaml",
                source_file=Path(MAPS_FOLDER) / folder / f"{pair.source}.yaml",
            ),
            method.title,
        )
        for pair in pairs
    ]
