"""Trials: every method answers every pair, on one thread, and each answer is evaluated."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

from mapping.geometry.scale_range import ScaleRange
from mapping.map_set import MapSet
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, evaluate_pair
from mapquilt.jobs.runner import Progress, Runner, no_progress
from mapquilt.jobs.timing import one_thread, warm_up
from merge.merger import match_maps
from merge.methods import published_names
from merge.settings import MergeSettings


@dataclass(frozen=True)
class TrialTask:
    """Input of a worker for one pair."""

    pair: BenchmarkPair
    methods: tuple[MergeSettings, ...]
    seed: int


def chosen_methods(names: Sequence[str], scale: ScaleRange | None, as_published: bool) -> tuple[MergeSettings, ...]:
    """Build the settings of each method; ``as_published`` adds those that decide for themselves a second time.

    Raises ``ValueError`` naming an unknown method, or one that is named twice.
    """
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"--method {name}: is named twice")
    chosen = []
    for name in names:
        chosen.append(MergeSettings(name, scale))
        if as_published and name in published_names():
            chosen.append(MergeSettings(name, scale, as_published=True))
    return tuple(chosen)


def run_benchmark(
    pairs: Sequence[BenchmarkPair],
    methods: tuple[MergeSettings, ...],
    seed: int,
    runner: Runner,
    on_progress: Progress = no_progress,
) -> list[EvaluatedPair]:
    """Evaluate every pair, method after method and in the order of pairs, whatever the workers.

    Raises ``ValueError`` or ``OSError`` naming the file of a map that cannot be used.
    """
    answers = runner.run(run_trial, [TrialTask(pair, methods, seed) for pair in pairs], on_progress)
    return [of_pair[method] for method in range(len(methods)) for of_pair in answers]


def run_trial(task: TrialTask) -> tuple[EvaluatedPair, ...]:
    """Let every method answer one pair in turn. Raises ``ValueError`` or ``OSError`` naming a bad map file."""
    maps = task.pair.maps()
    with one_thread():
        for settings in task.methods:
            warm_up(settings)
        return tuple(_evaluate(task, maps, settings) for settings in task.methods)


def _evaluate(task: TrialTask, maps: MapSet, settings: MergeSettings) -> EvaluatedPair:
    start = time.process_time()
    (result,) = match_maps(maps, settings, task.seed)
    seconds = time.process_time() - start
    truth = task.pair.metric_truth(maps)
    target, source = maps.grids
    return evaluate_pair(target, source, truth, result, pair=task.pair.info, method=settings.title, seconds=seconds)
