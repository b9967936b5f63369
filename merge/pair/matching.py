"""Matching of pairs of maps, each by itself, here or on the workers of an executor."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
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
from mapping.seeds import Role, stream
from merge.methods import proposers_of, published_of
from merge.pair.feature_cache import (
    FeatureCache,
    MapFeatures,
    Method,
    cell_width,
    map_cells_from_prepared,
    metres_from_prepared,
)
from merge.pair.pipeline import merge_pair
from merge.preparation.settings import PreparationSettings
from merge.records.pair_answer import PairAnswer
from merge.records.result import Alternative, PairResult
from merge.records.verdict import Reason, Verdict
from merge.settings import MergeSettings

Task = TypeVar("Task")
Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class PairTask:
    """Two maps to match, and all that it takes: a worker knows nothing else. ``scale`` bounds stated metres of the
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
        """The proposers of the method, or the method as published."""
        settings = self.settings
        if settings.as_published:
            return (published_of(settings.method, settings.proposers),)
        return proposers_of(settings.method, settings.proposers)

    def features(
        self, cache: FeatureCache | None, methods: Sequence[Method] | None = None
    ) -> tuple[MapFeatures, MapFeatures]:
        """Return the features of target and source, from the cache of the process if none is given."""
        cache = cache or _process_feature_cache(self.settings.preparation)
        methods = self.methods if methods is None else methods
        return cache.features(self.grids[0], methods), cache.features(self.grids[1], methods)

    def in_cells(self, scale: ScaleRange, features: tuple[MapFeatures, MapFeatures]) -> ScaleRange:
        """Convert a scale in stated metres to cells of the prepared target per cell of the prepared source."""
        target, source = features
        return scale.times(self.cells_per_cell * cell_width(source.prepared) / cell_width(target.prepared))


def match(task: PairTask, cache: FeatureCache | None = None) -> PairResult:
    """Match one pair. The answer depends neither on other maps nor on which of the two comes first."""
    features = task.features(cache)
    answer = _answer(*features, task.in_cells(task.scale, features), task.settings, task.seed)
    if answer.verdict.accepted or task.settings.scale is not None or not task.scale.fixed:
        return to_result(task, answer, features)
    return to_result(task, _at_another_scale(task, features) or answer, features)


def _at_another_scale(task: PairTask, features: tuple[MapFeatures, MapFeatures]) -> PairAnswer | None:
    """Return a refusal that states the scale at which the maps match, if they match at another than they state.

    None if they do not. Only the first proposer is asked, to save time.
    """
    answer = _answer(*features, task.in_cells(ScaleRange.free(), features), task.settings, task.seed, proposers=1)
    if not answer.verdict.accepted:
        return None
    found = to_result(task, answer, features).target_from_source
    if found is None or abs(math.log(found.scale)) < task.settings.pair.same_log_scale:
        return None
    return replace(answer, verdict=Verdict.refuse(Reason.OTHER_SCALE, detail=f", {found.scale:.3g} times that"))


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


def _answer(
    target: MapFeatures,
    source: MapFeatures,
    scale: ScaleRange,
    settings: MergeSettings,
    seed: int,
    proposers: int | None = None,
) -> PairAnswer:
    """Merge the pair in canonical order, by the first ``proposers`` of the method, or all."""
    rng = stream(seed, Role.MERGE)
    if canonical_order(target.prepared.grid) <= canonical_order(source.prepared.grid):
        return _answer_in_order(target, source, scale, settings, rng, proposers)
    return _answer_in_order(source, target, scale.inverse(), settings, rng, proposers).inverse()


def _answer_in_order(
    target: MapFeatures,
    source: MapFeatures,
    scale: ScaleRange,
    settings: MergeSettings,
    rng: np.random.Generator,
    proposers: int | None,
) -> PairAnswer:
    if settings.as_published:
        method = published_of(settings.method, settings.proposers)
        return method.published(target.descriptions[0], source.descriptions[0], scale, rng)
    chosen = proposers_of(settings.method, settings.proposers)[:proposers]
    return merge_pair(target, source, scale, chosen, rng, settings)


def canonical_order(grid: OccupancyGrid) -> tuple[tuple[int, int], bytes]:
    """Return a sort key by content, so that no result depends on the order in which maps are given."""
    return grid.frame.shape, grid.log_odds.tobytes()


def to_result(task: PairTask, answer: PairAnswer, features: tuple[MapFeatures, MapFeatures]) -> PairResult:
    """Convert an answer from cells of the prepared maps to metres and pixels of the maps."""
    frames = task.grids[0].frame, task.grids[1].frame

    def in_pixels(cells: Similarity2) -> NDArray[np.float64]:
        return _pixels(features[0], cells, features[1], frames)

    def in_metres(cells: Similarity2) -> Similarity2:
        return similarity_from_pixels(frames[0], in_pixels(cells), frames[1])

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
