"""One pair, all methods: answers, errors and times."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache

import cv2
import numba
import numpy as np

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.evaluation.transform_error import FOUND, RIGHT, TransformError, normalised_error, transform_error
from merge.merger import match_maps
from merge.records.result import Alternative, Evidence, PairResult
from merge.settings import MergeSettings


@dataclass(frozen=True)
class Answer:
    """What a method said of a pair, how far that is from the truth (None where there is none, or no answer), and the
    seconds of the processor that it took, the look at both maps included. ``normalised_error`` is that of
    ``normalised_error``, None also where no covariance was told; ``runner_up`` is the best other
    place."""

    method: str
    accepted: bool
    confidence: float
    reason: str | None
    target_from_source: Similarity2 | None
    evidence: Evidence | None
    error: TransformError | None
    seconds: float
    normalised_error: float | None = None
    runner_up: Alternative | None = None

    @property
    def right(self) -> bool:
        return self.error is not None and RIGHT.holds(self.error)

    @property
    def found(self) -> bool:
        """Whether the place is the right one, however inexactly told."""
        return self.error is not None and FOUND.holds(self.error)


@dataclass(frozen=True)
class Trial:
    """A pair with the answers of all methods, in their order, and its truth in metres as the maps state them."""

    pair: BenchmarkPair
    bent: bool
    answers: tuple[Answer, ...]
    truth: Similarity2 | None = None

    @property
    def negative(self) -> bool:
        return self.pair.truth is None

    @property
    def sound(self) -> bool:
        """Whether the pair has one right answer, which is known well enough."""
        return not self.negative and self.pair.identifiable and not self.bent


@dataclass(frozen=True)
class TrialTask:
    """What a worker needs for one pair."""

    pair: BenchmarkPair
    methods: tuple[MergeSettings, ...]
    seed: int


def run_trial(task: TrialTask) -> Trial:
    """Let every method answer in turn, on one thread. Raises ``ValueError`` or ``OSError`` naming a bad map file."""
    maps = task.pair.maps()
    with one_thread():
        for settings in task.methods:
            warm_up(settings)
        answers = tuple(_answer(task.pair, maps, settings, task.seed) for settings in task.methods)
    return Trial(task.pair, task.pair.bent(maps), answers, task.pair.target_from_source(maps))


def _answer(pair: BenchmarkPair, maps: MapSet, settings: MergeSettings, seed: int) -> Answer:
    start = time.process_time()
    (result,) = match_maps(maps, settings, seed)
    seconds = time.process_time() - start
    return Answer(
        settings.title,
        result.accepted,
        result.confidence,
        result.reason_text,
        result.target_from_source,
        result.evidence,
        _error(pair, maps, result),
        seconds,
        _normalised_error(pair, maps, result),
        result.alternatives[0] if result.alternatives else None,
    )


def _error(pair: BenchmarkPair, maps: MapSet, result: PairResult) -> TransformError | None:
    truth = pair.target_from_source(maps)
    if truth is None or result.target_from_source is None:
        return None
    return transform_error(maps.grids[0], maps.grids[1], truth, result.target_from_source, pair.target_scale)


def _normalised_error(pair: BenchmarkPair, maps: MapSet, result: PairResult) -> float | None:
    truth = pair.target_from_source(maps)
    if truth is None or result.target_from_source is None or result.covariance is None:
        return None
    return normalised_error(truth, result.target_from_source, result.covariance)


@contextmanager
def one_thread() -> Iterator[None]:
    """OpenCV and numba on one thread within the block."""
    before = cv2.getNumThreads(), numba.get_num_threads()
    cv2.setNumThreads(1)
    numba.set_num_threads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before[0])
        numba.set_num_threads(before[1])


@cache
def warm_up(settings: MergeSettings) -> None:
    """Once a process: what is compiled or loaded on first use shall not count as the first pair's time."""
    walls = np.random.default_rng(0).random((12, 16)) < 0.3
    cells = np.pad(np.kron(np.where(walls, 1.0, -1.0), np.ones((12, 12))), 4)
    grid = OccupancyGrid(GridFrame(1.0, SE2.identity(), (cells.shape[0], cells.shape[1])), cells.astype(np.float32))
    match_maps(MapSet(("a", "b"), (grid, grid), ("cell", "cell")), settings)
