"""One mission of a study: sensed at every level, merged by every method, scored against the truth."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import reduce
from pathlib import Path

import numpy as np

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import map_files
from mapping.map_set import MapSet
from mapquilt.benchmark.trial import one_thread, warm_up
from mapquilt.evaluation.map_quality import map_quality
from mapquilt.evaluation.transform_error import RIGHT, TransformError, transform_error
from mapquilt.runs.sample import Sample, make_sample
from mapquilt.runs.seen_slices import SeenSlices
from mapquilt.runs.true_footprints import TrueFootprints, true_places
from mapquilt.study.missions import cut_mission, largest_mission
from mapquilt.study.plan import Level, Method, MissionTask
from mapquilt.study.setup import ExperimentConfig
from merge.merger import merge_maps
from merge.records.result import MergeResult, PairResult
from sim.mission.mission import Mission

Place = tuple[float, float, float, float]
"""x, y, yaw, scale of a similarity."""


@dataclass(frozen=True)
class PairTrial:
    """A pair of maps at one level and what a method said of it, beside the truth.

    Errors are None where there was no answer. ``bent`` says that the truth's own residual exceeds half the
    displacement allowed, or that none could be fitted: even a perfect answer may miss then. ``maps`` is the folder of
    the two maps among the study's.
    """

    mission: str
    world: str
    level: Level
    noise: float
    method: str
    target: str
    source: str
    overlap: float
    identifiable: bool
    bent: bool
    accepted: bool
    right: bool
    confidence: float
    reason: str | None
    rotation_deg: float | None
    scale_percent: float | None
    displacement_m: float | None
    displacement_cells: float | None
    displacement_of_diagonal: float | None
    acceptance_index: float | None
    score: float | None
    second_best_score: float | None
    answer: Place | None
    truth: Place
    runner_up: Place | None
    runner_up_score: float | None
    maps: str


@dataclass(frozen=True)
class TeamTrial:
    """A team's merge by one method at one level: how many of its maps were joined, how good the fused map is, and
    seconds of the processor on one thread."""

    mission: str
    world: str
    level: Level
    method: str
    maps: int
    joined: int
    iou_free: float
    f1_walls: float
    pairs: int
    seconds: float


@dataclass(frozen=True)
class Failure:
    """Why a mission could not be had, or not be mapped at a level."""

    mission: str
    level: Level | None
    reason: str


@dataclass
class MissionTrials:
    """All that one mission gave, with the map files by path, and what was odd."""

    pairs: list[PairTrial] = field(default_factory=list)
    teams: list[TeamTrial] = field(default_factory=list)
    failures: list[Failure] = field(default_factory=list)
    files: dict[str, bytes] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)


def run_mission(task: MissionTask) -> MissionTrials:
    """A function of the task alone, but for the times. What cannot be simulated or mapped is told as a failure."""
    trials = MissionTrials()
    with one_thread(), warnings.catch_warnings(record=True) as odd:
        warnings.simplefilter("always", UserWarning)
        for method in task.methods:
            warm_up(ExperimentConfig().merge(method.name, method.as_published))
        _run(task, trials)
    trials.warnings = [str(one.message) for one in odd if one.category is UserWarning]
    return trials


def _run(task: MissionTask, trials: MissionTrials) -> None:
    by_drive: dict[ExperimentConfig, list[ExperimentConfig]] = {}
    for _, setup in task.levels:
        by_drive.setdefault(setup.drive_part(), []).append(setup)
    missions: dict[ExperimentConfig, Mission] = {}
    places: dict[ExperimentConfig, tuple[Mission, TrueFootprints]] = {}
    samples: dict[ExperimentConfig, Sample] = {}
    for number, (level, setup) in enumerate(task.levels):
        drive, place, maps = setup.drive_part(), setup.place_part(), setup.map_part()
        try:
            if drive not in missions:
                missions[drive] = largest_mission(task.world, task.seed, by_drive[drive], task.cache)
            if place not in places:
                cut = cut_mission(missions[drive], setup)
                seen = SeenSlices(cut, (setup.parts,), setup.clear_range)
                places[place] = cut, true_places(cut, setup.parts, seen)
            if maps not in samples:
                samples = {maps: make_sample(places[place][0], setup.sample(task.sample_seed), places[place][1])}
        except ValueError as error:
            trials.failures.append(Failure(task.name, level, str(error)))
            continue
        folder = f"{task.name}/{number:02d}"
        trials.files.update(_map_bytes(folder, samples[maps].maps))
        for method in task.methods:
            _merge(task, level, setup, method, samples[maps], folder, trials)


def _map_bytes(folder: str, maps: MapSet) -> dict[str, bytes]:
    files = {}
    for name, grid in zip(maps.names, maps.grids, strict=True):
        for path, data in map_files(grid, Path(folder) / name, picture="png").items():
            files[path.as_posix()] = data
    return files


def _merge(
    task: MissionTask,
    level: Level,
    setup: ExperimentConfig,
    method: Method,
    sample: Sample,
    folder: str,
    trials: MissionTrials,
) -> None:
    start = time.process_time()
    result = merge_maps(sample.maps, setup.merge(method.name, method.as_published), task.sample_seed)
    seconds = time.process_time() - start
    world = setup.world or task.world
    quality = map_quality(
        result.merged, sample.truth.robot(result.reference).truth.world_from_map, _seen_by_team(sample.places)
    )
    trials.teams.append(
        TeamTrial(
            task.name,
            world,
            level,
            method.title,
            len(sample.maps),
            len(result.reference_from_map),
            quality.iou_free,
            quality.f1_walls,
            len(result.pairs),
            seconds,
        )
    )
    for pair in _of_two_robots(sample, result):
        trials.pairs.append(_trial(task.name, world, level, setup, method, sample, pair, folder))


def _of_two_robots(sample: Sample, result: MergeResult) -> Iterator[PairResult]:
    robot = {place.name: place.robot for place in sample.places.maps}
    yield from (pair for pair in result.pairs if robot[pair.target] != robot[pair.source])


def _seen_by_team(places: TrueFootprints) -> OccupancyGrid:
    known = reduce(np.logical_or, (place.footprint.known for place in places.maps))
    return OccupancyGrid(places.world.frame, np.where(known, places.world.log_odds, np.float32(0.0)))


def _trial(
    mission: str,
    world: str,
    level: Level,
    setup: ExperimentConfig,
    method: Method,
    sample: Sample,
    pair: PairResult,
    folder: str,
) -> PairTrial:
    truth = sample.truth.pairs[pair.target, pair.source]
    target, source = (sample.maps.grids[sample.maps.names.index(name)] for name in (pair.target, pair.source))
    scale = sample.truth.robot(pair.target).truth.world_from_map.scale
    error = None
    if pair.target_from_source is not None:
        error = transform_error(target, source, truth.target_from_source, pair.target_from_source, scale)
    allowed = RIGHT.displacement_of_diagonal * target.known_diagonal * scale
    evidence, other = pair.evidence, pair.alternatives[0] if pair.alternatives else None
    moved = error or TransformError(0.0, 0.0, None, None, None)
    return PairTrial(
        mission=mission,
        world=world,
        level=level,
        noise=setup.noise,
        method=method.title,
        target=pair.target,
        source=pair.source,
        overlap=truth.footprints.overlap,
        identifiable=truth.footprints.identifiability.identifiable,
        bent=truth.residual is None or truth.residual > allowed / 2.0,
        accepted=pair.accepted,
        right=error is not None and RIGHT.holds(error),
        confidence=pair.confidence,
        reason=pair.reason_text,
        rotation_deg=None if error is None else error.rotation_deg,
        scale_percent=None if error is None else error.scale_percent,
        displacement_m=moved.displacement_m,
        displacement_cells=moved.displacement_cells,
        displacement_of_diagonal=moved.displacement_of_diagonal,
        acceptance_index=None if evidence is None else evidence.acceptance_index,
        score=None if evidence is None else evidence.score,
        second_best_score=None if evidence is None else evidence.second_best_score,
        answer=_place(pair.target_from_source),
        truth=_numbers(truth.target_from_source),
        runner_up=None if other is None else _numbers(other.target_from_source),
        runner_up_score=None if other is None else other.score,
        maps=folder,
    )


def _place(transform: Similarity2 | None) -> Place | None:
    return None if transform is None else _numbers(transform)


def _numbers(transform: Similarity2) -> Place:
    return transform.x, transform.y, transform.yaw, transform.scale
