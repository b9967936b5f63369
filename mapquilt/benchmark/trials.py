"""Trials: every method answers every pair, on one thread, and each answer is evaluated."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from mapping.geometry.scale_range import ScaleRange
from mapping.grid.pixel_matrix import similarity_from_pixels
from mapping.io.safe_load import reading
from mapping.io.shape import require_shape
from mapping.map_set import MapSet
from mapquilt.benchmark.exchange.answers import GivenAnswer
from mapquilt.benchmark.exchange.identity import pair_identities
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.results import UNIT
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, evaluate_pair
from mapquilt.evaluation.pair_rows import from_row, to_row
from mapquilt.jobs.journal import JOURNAL_FILE, TASKS_FILE, Entries, Entry, Journal, counting, job_folder
from mapquilt.jobs.runner import Progress, Runner, no_progress
from mapquilt.jobs.timing import one_thread, warm_up
from merge.merger import match_maps
from merge.methods import published_names
from merge.records.result import PairResult
from merge.settings import MergeSettings


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
) -> Sequence[EvaluatedPair]:
    """Evaluate every pair, method after method and in the order of pairs, whatever the workers.

    ``given`` are answers of other programs to each pair, evaluated after those of the methods. With a folder ``work``
    for unfinished work, an interrupted call continues where it stopped, and the answers stay in the folder, each read
    on access.

    Raises ``ValueError`` or ``OSError`` naming the file of a map that cannot be used, or the folder if other work was
    begun there.
    """
    others = given or [()] * len(pairs)
    tasks = [
        TrialTask(number, pair, methods, seed, answers)
        for number, (pair, answers) in enumerate(zip(pairs, others, strict=True))
    ]
    if work is None:
        found = runner.run(run_trial, tasks, on_progress)
        return [one for of_method in zip(*found, strict=True) for one in of_method]
    with job_folder(work, "benchmark of mapquilt", TASKS_FILE, _tasks_text(tasks, methods, seed)):
        journal = Journal[TrialTask](work / JOURNAL_FILE, lambda task: str(task.number), _check_entry)
        return StoredAnswers(
            journal.run(runner, run_trial, tasks, _entry, _is_whole, counting(on_progress, len(tasks)))
        )


class StoredAnswers(Sequence[EvaluatedPair]):
    """Answers in a journal, method after method in the order of pairs. Each is read on access."""

    def __init__(self, entries: Entries) -> None:
        self._entries = entries
        self._tasks = tuple(entries)
        self._methods = len(entries[self._tasks[0]]["rows"]) if entries else 0

    def __len__(self) -> int:
        return self._methods * len(self._tasks)

    def __getitem__(self, index: Any) -> Any:
        method, pair = divmod(range(len(self))[index], len(self._tasks))
        return _answer(self._entries[self._tasks[pair]], method)

    def __iter__(self) -> Iterator[EvaluatedPair]:
        for method in range(self._methods):
            for entry in self._entries.values():
                yield _answer(entry, method)


def _tasks_text(tasks: Sequence[TrialTask], methods: Sequence[MergeSettings], seed: int) -> str:
    """Describe all that the answers depend on: settings, seed, and a hash of the maps and truth of every pair."""
    digest = sha256()
    for task, identity in zip(tasks, pair_identities(task.pair for task in tasks), strict=True):
        digest.update(f"{identity} {task.pair.info.title} {task.pair.truth!r} {task.given!r}\n".encode())
    content = {"methods": list(map(repr, methods)), "seed": seed, "pairs": len(tasks), "digest": digest.hexdigest()}
    return json.dumps(content, indent=1)


def _entry(task: TrialTask, result: tuple[EvaluatedPair, ...] | BaseException) -> Entry:
    if isinstance(result, BaseException):
        raise result
    return {"rows": [to_row(one) for one in result], "seconds": [one.seconds for one in result]}


def _is_whole(task: TrialTask, entry: Entry) -> bool:
    return len(entry["rows"]) == len(task.methods) + len(task.given)


def _check_entry(entry: Entry, place: str) -> None:
    require_shape(entry, {"rows": [dict], "seconds": [float | None]}, place)
    with reading(place):
        if len(entry["rows"]) != len(entry["seconds"]):
            raise ValueError(f"has {len(entry['rows'])} rows, but {len(entry['seconds'])} seconds")
        for method in range(len(entry["rows"])):
            _answer(entry, method)


def _answer(entry: Entry, method: int) -> EvaluatedPair:
    return replace(from_row(entry["rows"][method]), seconds=entry["seconds"][method])


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
