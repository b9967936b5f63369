"""All pairs, all methods."""

from __future__ import annotations

from collections.abc import Sequence

from mapping.geometry.scale_range import ScaleRange
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.trial import Trial, TrialTask, run_trial
from mapquilt.jobs.runner import Progress, Runner, no_progress
from merge.methods import PUBLISHED
from merge.settings import MergeSettings


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
    runner: Runner,
    on_progress: Progress = no_progress,
) -> list[Trial]:
    """Return a trial for each pair, in order, whatever the workers.

    Raises ``ValueError`` or ``OSError`` naming the file of a map that cannot be used.
    """
    return runner.run(run_trial, [TrialTask(pair, methods, seed) for pair in pairs], on_progress)
