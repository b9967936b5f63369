"""Trials: every method answers every pair, on one thread, and each answer is evaluated."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path

from mapping.geometry.scale_range import ScaleRange
from mapping.grid.pixel_matrix import similarity_from_pixels
from mapping.io.safe_load import reading
from mapping.io.shape import require_shape
from mapping.map_set import MapSet
from mapquilt.benchmark.exchange.answers import GivenAnswer
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.results import UNIT
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, evaluate_pair
from mapquilt.evaluation.pair_rows import from_row, to_row
from mapquilt.jobs.journal import JOURNAL_FILE, Entry, Journal, job_folder
from mapquilt.jobs.runner import Progress, Runner, no_progress
from mapquilt.jobs.timing import one_thread, warm_up
from merge.merger import match_maps
from merge.methods import published_names
from merge.records.result import PairResult
from merge.settings import MergeSettings

TASKS_FILE = "tasks.json"


@dataclass(frozen=True)
class TrialTask:
    """Input of a worker for one pair, the one of that ``number``; ``given`` are the answers of other programs to it."""

    number: int
    pair: BenchmarkPair
    methods: tuple[MergeSettings, ...]
    seed: int
    given: tuple[GivenAnswer, ...] = ()


def chosen_methods(names: Sequence[str], scale: ScaleRange | None, as_published: bool) -> tuple[MergeSettings, ...]:
    """Build the settings of each method; ``as_published`` adds those that decide for themselves a second time.

    Plain ORB always runs alone as well, since its time is the unit.

    Raises ``ValueError`` naming an unknown method, or one that is named twice.
    """
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"--method {name}: is named twice")
    chosen = []
    for name in names:
        chosen.append(MergeSettings(name, scale))
        if name == UNIT or (as_published and name in published_names()):
            chosen.append(MergeSettings(name, scale, as_published=True))
    return tuple(chosen)


def run_benchmark(
    pairs: Sequence[BenchmarkPair],
    methods: tuple[MergeSettings, ...],
    seed: int,
    runner: Runner,
    on_progress: Progress = no_progress,
    work: Path | None = None,
    given: Sequence[tuple[GivenAnswer, ...]] = (),
) -> list[EvaluatedPair]:
    """Evaluate every pair, method after method and in the order of pairs, whatever the workers.

    ``given`` are answers of other programs to each pair, evaluated after those of the methods. With a folder ``work``
    for unfinished work, an interrupted call continues where it stopped.

    Raises ``ValueError`` or ``OSError`` naming the file of a map that cannot be used, or the folder if other work was
    begun there.
    """
    others = given or [()] * len(pairs)
    tasks = [
        TrialTask(number, pair, methods, seed, answers)
        for number, (pair, answers) in enumerate(zip(pairs, others, strict=True))
    ]
    if work is None:
        answers = runner.run(run_trial, tasks, on_progress)
    else:
        with job_folder(work, "benchmark of mapquilt", TASKS_FILE, _tasks_text(tasks)):
            journal = Journal[TrialTask](work / JOURNAL_FILE, lambda task: str(task.number), _check_entry)
            entries = journal.run(
                runner, run_trial, tasks, _entry, on_entries=lambda done: on_progress(len(done), len(tasks))
            )
        answers = [_answers(entry) for entry in entries]
    return [one for of_method in zip(*answers, strict=True) for one in of_method]


def unfinished_folder(out: Path) -> Path:
    """Name the folder beside ``out`` that holds its unfinished work."""
    return out.with_name(f".{out.name}.unfinished")


def _tasks_text(tasks: Sequence[TrialTask]) -> str:
    """Describe all that the answers depend on: settings, seed, and the maps and truth of every pair."""
    pairs = [
        [
            task.pair.info.title,
            *(sha256(file.read_bytes()).hexdigest() for file in (task.pair.target_file, task.pair.source_file)),
            repr(task.pair.truth),
        ]
        for task in tasks
    ]
    methods = [repr(settings) for settings in tasks[0].methods] if tasks else []
    given = sorted({repr(answer) for task in tasks for answer in task.given})
    content = {"methods": methods, "seeds": sorted({task.seed for task in tasks}), "given": given, "pairs": pairs}
    return json.dumps(content, indent=1)


def _entry(task: TrialTask, result: tuple[EvaluatedPair, ...] | BaseException) -> Entry:
    if isinstance(result, BaseException):
        raise result
    return {"rows": [to_row(one) for one in result], "seconds": [one.seconds for one in result]}


def _check_entry(entry: Entry, place: str) -> None:
    require_shape(entry, {"rows": [dict], "seconds": [float | None]}, place)
    with reading(place):
        _answers(entry)


def _answers(entry: Entry) -> tuple[EvaluatedPair, ...]:
    timed = zip(entry["rows"], entry["seconds"], strict=True)
    return tuple(replace(from_row(row), seconds=seconds) for row, seconds in timed)


def run_trial(task: TrialTask) -> tuple[EvaluatedPair, ...]:
    """Let every method answer one pair in turn, then evaluate the given answers.

    Raises ``ValueError`` or ``OSError`` naming a bad map file.
    """
    maps = task.pair.maps()
    with one_thread():
        for settings in task.methods:
            warm_up(settings)
        answers = [_evaluate(task, maps, settings) for settings in task.methods]
    return (*answers, *(_evaluate_given(task, maps, given) for given in task.given))


def _evaluate(task: TrialTask, maps: MapSet, settings: MergeSettings) -> EvaluatedPair:
    start = time.process_time()
    (result,) = match_maps(maps, settings, task.seed)
    seconds = time.process_time() - start
    truth = task.pair.metric_truth(maps)
    target, source = maps.grids
    return evaluate_pair(target, source, truth, result, pair=task.pair.info, method=settings.title, seconds=seconds)


def _evaluate_given(task: TrialTask, maps: MapSet, given: GivenAnswer) -> EvaluatedPair:
    target, source = maps.grids
    pixels, transform = None, None
    if given.target_from_source is not None:
        pixels = given.target_from_source.matrix()
        transform = similarity_from_pixels(target.frame, pixels, source.frame)
    result = PairResult(
        target=maps.names[0],
        source=maps.names[1],
        accepted=given.accepted,
        confidence=given.confidence,
        refusal=None,
        target_from_source=transform,
        target_from_source_pixels=pixels,
        unit=maps.units[0],
        evidence=None,
    )
    return evaluate_pair(
        target,
        source,
        task.pair.metric_truth(maps),
        result,
        pair=task.pair.info,
        method=given.method,
        seconds=given.seconds,
    )
