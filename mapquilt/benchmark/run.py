"""All pairs, all methods."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing

from mapping.geometry.scale_range import ScaleRange
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.trial import Trial, TrialTask, run_trial
from mapquilt.jobs.executor import process_pool, run_all
from merge.methods import PUBLISHED
from merge.settings import MergeSettings

Progress = Callable[[int, int], None]
"""Called with how many pairs are done, of how many."""


def chosen_methods(names: Sequence[str], scale: ScaleRange | None, as_published: bool) -> tuple[MergeSettings, ...]:
    """The settings of each method; with ``as_published`` those that have an answer of their own come twice.

    Raises ``ValueError`` naming an unknown method, or one that is named twice.
    """
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"--method {name}: is named twice")
    chosen = []
    for name in names:
        chosen.append(MergeSettings(name, scale))
        if as_published and name in PUBLISHED:
            chosen.append(MergeSettings(name, scale, as_published=True))
    return tuple(chosen)


def run_benchmark(
    pairs: Sequence[BenchmarkPair],
    methods: tuple[MergeSettings, ...],
    seed: int,
    workers: int,
    on_progress: Progress = lambda done, total: None,
) -> list[Trial]:
    """A trial for each pair, in order, whatever the number of workers.

    Raises ``ValueError`` or ``OSError`` naming the file of a map that cannot be used.
    """
    tasks = [TrialTask(pair, methods, seed) for pair in pairs]
    done: dict[int, Trial] = {}
    for task, trial in _results(tasks, workers):
        done[id(task)] = trial
        on_progress(len(done), len(tasks))
    return [done[id(task)] for task in tasks]


def _results(tasks: Sequence[TrialTask], workers: int) -> Iterator[tuple[TrialTask, Trial]]:
    if workers == 1:
        yield from ((task, run_trial(task)) for task in tasks)
        return
    with closing(run_all(lambda: process_pool(workers), run_trial, tasks, workers)) as results:
        for task, result in results:
            if isinstance(result, BaseException):
                raise result
            yield task, result
