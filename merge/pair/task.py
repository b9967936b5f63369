"""A pair of maps to match as a task of its own, run here or on the workers of an executor."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, total_ordering
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.pixel_matrix import pixel_matrix, similarity_from_pixels
from mapping.map_set import MapSet, Unit
from merge.pair.feature_cache import (
    FeatureCache,
    MapFeatures,
    Method,
    cell_width,
    map_cells_from_prepared,
    metres_from_prepared,
)
from merge.preparation.settings import PreparationSettings
from merge.records.pair_answer import Alternative, PairAnswer
from merge.records.result import PairResult
from merge.settings import MergeSettings

Task = TypeVar("Task")
Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class PairTask:
    """Two maps to match, with everything that a worker needs. ``scale`` bounds stated metres of the
    target per stated metre of the source, or cells per cell where either map has no metres."""

    names: tuple[str, str]
    grids: tuple[OccupancyGrid, OccupancyGrid]
    units: tuple[Unit, Unit]
    scale: ScaleRange
    settings: MergeSettings
    seed: int

    @staticmethod
    def of(maps: MapSet, target: int, source: int, scale: ScaleRange, settings: MergeSettings, seed: int) -> PairTask:
        def both(values: Sequence[Result]) -> tuple[Result, Result]:
            return values[target], values[source]

        return PairTask(both(maps.names), both(maps.grids), both(maps.units), scale, settings, seed)

    @property
    def cells_per_cell(self) -> float:
        """Cells of the target map per cell of the source map at a scale of 1."""
        if "cell" in self.units:
            return 1.0
        return self.grids[1].frame.resolution / self.grids[0].frame.resolution

    @property
    def methods(self) -> tuple[Method, ...]:
        """Return the proposers of the method, or the method as published."""
        settings = self.settings
        return (settings.chosen_published,) if settings.as_published else settings.chosen_proposers

    def features(
        self, cache: FeatureCache | None, methods: Sequence[Method] | None = None
    ) -> tuple[MapFeatures, MapFeatures]:
        """Return the features of target and source, from the cache of the process if none is given."""
        cache = cache or _process_feature_cache(self.settings.preparation)
        methods = self.methods if methods is None else methods
        return cache.features(self.grids[0], methods), cache.features(self.grids[1], methods)

    def in_cells(self, scale: ScaleRange, features: tuple[MapFeatures, MapFeatures]) -> ScaleRange:
        """Convert a scale in stated metres to cells of the prepared map target per cell of the prepared map source."""
        target, source = features
        return scale.times(self.cells_per_cell * cell_width(source.prepared) / cell_width(target.prepared))


@cache
def _process_feature_cache(settings: PreparationSettings) -> FeatureCache:
    """Keep one cache in a worker process: tasks of one map follow one another, and it is prepared once."""
    return FeatureCache(settings)


class Runner(Protocol):
    """Run tasks elsewhere, such as on other processes."""

    def run(
        self, function: Callable[[Task], Result], tasks: Sequence[Task], on_progress: Callable[[int, int], None]
    ) -> list[Result]:
        """Return the result of each task, in their order, and call ``on_progress`` with how many are done, of all."""
        ...


def run_tasks(
    function: Callable[[Task, FeatureCache | None], Result],
    tasks: Sequence[Task],
    cache: FeatureCache,
    runner: Runner | None = None,
    on_done: Callable[[], None] = lambda: None,
) -> list[Result]:
    """Return the result of each task, in their order: on the runner, or here with the given cache."""
    if runner is not None:
        return runner.run(_with_process_cache, [(function, task) for task in tasks], lambda done, total: on_done())
    results = []
    for task in tasks:
        results.append(function(task, cache))
        on_done()
    return results


def _with_process_cache(call: tuple[Callable[[Task, FeatureCache | None], Result], Task]) -> Result:
    function, task = call
    return function(task, None)


@total_ordering
class CanonicalOrder:
    """A sort key of a grid by its content, so that no result depends on the order in which maps are given.

    It compares shapes, then the bytes of the cells, row by row.
    """

    def __init__(self, grid: OccupancyGrid) -> None:
        self._shape, self._cells = grid.frame.shape, grid.log_odds

    def __eq__(self, other: object) -> bool:
        return isinstance(other, CanonicalOrder) and self._shape == other._shape and self._pair(other) is None

    def __lt__(self, other: CanonicalOrder) -> bool:
        if self._shape != other._shape:
            return self._shape < other._shape
        rows = self._pair(other)
        return rows is not None and rows[0] < rows[1]

    def _pair(self, other: CanonicalOrder) -> tuple[bytes, bytes] | None:
        """Return the first rows that differ in their bytes; None if none do."""
        rows = ((a.tobytes(), b.tobytes()) for a, b in zip(self._cells, other._cells, strict=True))
        return next((pair for pair in rows if pair[0] != pair[1]), None)


def to_result(task: PairTask, answer: PairAnswer, features: tuple[MapFeatures, MapFeatures]) -> PairResult:
    """Convert an answer from cells of the prepared map maps to metres and pixels of the maps."""
    frames = task.grids[0].frame, task.grids[1].frame

    def in_pixels(cells: Similarity2) -> NDArray[np.float64]:
        return _pixels(features[0], cells, features[1], frames)

    def in_metres(cells: Similarity2) -> Similarity2:
        metres = similarity_from_pixels(frames[0], in_pixels(cells), frames[1])
        bounded = task.scale.clip(metres.scale)  # a scale at a bound is that bound, not a rounding beside it
        return replace(metres, scale=bounded) if math.isclose(metres.scale, bounded, rel_tol=1e-12) else metres

    found, metric, covariance = answer.target_from_source, None, None
    if found is not None:
        metric = in_metres(found)
        if answer.uncertainty is not None:
            metres = metres_from_prepared(frames[0], features[0].prepared)
            covariance = answer.uncertainty.of_parameters(metres, metric)
    return PairResult(
        target=task.names[0],
        source=task.names[1],
        accepted=answer.verdict.accepted,
        confidence=answer.verdict.confidence,
        refusal=answer.verdict.refusal,
        target_from_source=metric,
        target_from_source_pixels=None if found is None else in_pixels(found),
        unit=task.units[0],
        evidence=answer.evidence,
        covariance=covariance,
        alternatives=tuple(
            Alternative(in_metres(other.target_from_source), other.score) for other in answer.alternatives
        ),
    )


def _pixels(
    target: MapFeatures, cells: Similarity2, source: MapFeatures, frames: tuple[GridFrame, GridFrame]
) -> NDArray[np.float64]:
    corners = [map_cells_from_prepared(each.prepared) for each in (target, source)]
    bare = [GridFrame(1.0, SE2.identity(), frame.shape) for frame in frames]
    return pixel_matrix(bare[0], corners[0] @ cells @ corners[1].inverse(), bare[1])
