"""The team of maps to merge: its maps, settings and local frames, and the workers that match its pairs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import TypeVar

import numpy as np

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet
from merge.multimap.graph import (
    Cluster,
    ConsistencyModel,
    Edge,
    LocalFrame,
    Pair,
    PairLikelihood,
    chain_confidences,
    edge_from_answer,
    pairs_of,
    placed_together,
)
from merge.multimap.overlap_likelihood import OverlapLikelihood
from merge.multimap.settings import MultimapSettings
from merge.pair.feature_cache import FeatureCache, metres_from_prepared
from merge.pair.task import CanonicalOrder, PairTask, Runner, run_tasks
from merge.preparation.settings import PreparationSettings
from merge.records.prior import Expected, expected_poses, shared_frame
from merge.records.result import PairResult
from merge.settings import MergeSettings

Task = TypeVar("Task")
Result = TypeVar("Result")

Answers = Mapping[Pair, PairResult]
"""Answers of pairs, by indices in the canonical order of the team's maps."""


class TaskRunner:
    """Run tasks here or by a runner, and report progress: tasks done, tasks known so far."""

    def __init__(
        self,
        runner: Runner | None,
        on_progress: Callable[[int, int], None] | None,
        cache: FeatureCache,
    ) -> None:
        self.cache = cache
        self._runner, self._on_progress = runner, on_progress
        self._done, self._planned = 0, 0

    def __call__(self, function: Callable[[Task, FeatureCache | None], Result], tasks: Sequence[Task]) -> list[Result]:
        """Apply the function to each task, in order."""
        self._planned += len(tasks)
        return run_tasks(function, tasks, self.cache, self._runner, self._step)

    def _step(self) -> None:
        self._done += 1
        if self._on_progress is not None:
            self._on_progress(self._done, self._planned)


@dataclass(frozen=True, eq=False)
class Team:
    """A merge to solve. ``maps`` are in a canonical order, so that their order as given, ``names``, changes nothing.

    ``scale`` bounds the answers, ``expected`` are relative poses that priors state, by names; ``frames`` are the local
    frames of the maps; ``model`` measures how edges, cells and poses agree; ``run`` matches pairs.
    """

    names: tuple[str, ...]
    maps: MapSet
    settings: MergeSettings
    seed: int
    scale: ScaleRange
    expected: Mapping[tuple[str, str], Expected]
    frames: tuple[LocalFrame, ...]
    likelihood: OverlapLikelihood
    model: ConsistencyModel
    run: TaskRunner

    @staticmethod
    def of(
        maps: MapSet,
        settings: MergeSettings,
        seed: int = 0,
        on_progress: Callable[[int, int], None] | None = None,
        runner: Runner | None = None,
        cache: FeatureCache | None = None,
    ) -> Team:
        """Prepare a merge; a ``cache`` may hold maps of it. Raises ``ValueError`` for priors that say nothing.

        Refused pairs of an indexed team are not explained: there are thousands, and most show other places. Its local
        frames have wide cells, so that all its maps can be kept prepared.
        """
        scale = settings.scale if settings.scale is not None else maps.scale_range
        indexed = _is_indexed(maps, scale, settings.multimap)
        if indexed:
            settings = replace(settings, pair=replace(settings.pair, explains_refusals=False))
        cache = FeatureCache(settings.preparation) if cache is None else cache
        run, ordered = TaskRunner(runner, on_progress, cache), _in_canonical_order(maps)
        wide = FeatureCache(in_wide_cells(settings)) if indexed else cache
        frames = tuple(local_frames(ordered, wide))
        likelihood = OverlapLikelihood(ordered, frames, wide, settings.multimap.likelihood, settings.alignment)
        extents = {name: frame.extent for name, frame in zip(ordered.names, frames, strict=True)}
        frame = shared_frame(settings.priors, settings.reference, maps.names)
        expected = (
            {} if settings.trust_priors else expected_poses(settings.priors, frame, settings.prior, scale, extents)
        )
        return Team(
            names=maps.names,
            maps=ordered,
            settings=settings,
            seed=seed,
            scale=scale,
            expected=expected,
            frames=frames,
            likelihood=likelihood,
            model=ConsistencyModel(
                _with_priors(likelihood, expected, ordered.names, frames, settings.prior.contradiction_log_odds),
                scale.fixed,
                settings.multimap,
                None if expected else tuple(frame.diagonal for frame in frames),
                not indexed,
            ),
            run=run,
        )

    def forget_features(self) -> None:
        """Free the memory of prepared maps and features; they are made again if needed."""
        self.run.cache.clear()
        self.likelihood.forget_prepared()

    @property
    def pairs(self) -> list[Pair]:
        return list(combinations(range(len(self.maps)), 2))

    @property
    def indexed(self) -> bool:
        """True if an index of wall patches ranks the pairs: of many maps, with metres that can be compared."""
        return _is_indexed(self.maps, self.scale, self.settings.multimap)

    @cached_property
    def _indices(self) -> Mapping[str, int]:
        return {name: index for index, name in enumerate(self.maps.names)}

    @cached_property
    def rank(self) -> Mapping[str, int]:
        """Places of the maps in the order in which they were given, by name."""
        return {name: index for index, name in enumerate(self.names)}

    def index(self, name: str) -> int:
        return self._indices[name]

    def pair(self, target: str, source: str) -> Pair:
        a, b = self.index(target), self.index(source)
        return min(a, b), max(a, b)

    def task(self, pair: Pair) -> PairTask:
        """Return the task to match a pair, its maps in the order in which they were given."""
        target, source = sorted(pair, key=lambda index: self.rank[self.maps.names[index]])
        return PairTask.of(self.maps, target, source, self.scale, self.settings, self.seed)

    def edge(self, answer: PairResult) -> Edge:
        """Turn an answer into an edge, the lower index as its target."""
        indices = self.index(answer.target), self.index(answer.source)
        settings, less = self.settings.multimap.edges, self.prior_log_odds
        edge = edge_from_answer(
            answer, indices, self.frames, replace(settings, max_log_odds=settings.max_log_odds + less)
        )
        edge = replace(edge, log_odds=edge.log_odds - less)
        return edge if edge.target < edge.source else edge.reversed()

    def edges(self, answers: Answers) -> list[Edge]:
        """Turn the accepted answers into edges."""
        return [self.edge(answers[pair]) for pair in sorted(answers) if answers[pair].accepted]

    @cached_property
    def prior_log_odds(self) -> float:
        """Log-odds that an answer in an indexed team loses against its confidence, 0 in others.

        The confidence supposes that about a third of all pairs match, as in a team of three. A map of a large building
        meets about as many others in a team of any size, and ever more that look like it.
        """
        return math.log(len(self.maps) / self.settings.multimap.clustering.prior_maps) if self.indexed else 0.0

    def metric(self, cluster: Cluster, target: str, source: str) -> Similarity2:
        """Return ``target_from_source`` in stated metres, as the poses of a cluster have it."""
        a, b = self.index(target), self.index(source)
        local = cluster.target_from_source(a, b)
        return self.frames[a].metres_from_local @ local @ self.frames[b].metres_from_local.inverse()

    def local(self, metric: Similarity2, target: int, source: int) -> Similarity2:
        """Express ``target_from_source`` in metres between the local frames."""
        return self.frames[target].metres_from_local.inverse() @ metric @ self.frames[source].metres_from_local

    def chain_confidences(self, cluster: Cluster, answers: Answers) -> dict[Pair, float]:
        """Return the confidence of the surest chain of accepted pairs between each two maps of a cluster."""
        return chain_confidences(sorted(cluster.poses), {p: answers[p].confidence for p in pairs_of(cluster.edges)})

    def priors_allow(self, first: Cluster, second: Cluster, first_from_second: Similarity2) -> bool:
        """Test if no prior of a map of either cluster contradicts an alignment of the two."""
        both, names = placed_together(first, second, first_from_second), self.maps.names
        pairs = ((names[a], names[b]) for a in first.poses for b in second.poses if self.expected)
        return all(self.expected[pair].allows(self.metric(both, *pair)) for pair in pairs if pair in self.expected)

    def agrees(self, answer: PairResult, cluster: Cluster) -> bool:
        """Test if an answer agrees with the poses of a cluster."""
        edge = self.edge(answer)
        return self.model.agrees(edge, cluster.target_from_source(edge.target, edge.source), edge.covariance)


@dataclass(frozen=True, eq=False)
class Solution:
    """The clusters of a team, each map in one, and the answer of every pair."""

    clusters: tuple[Cluster, ...]
    answers: Answers


def _is_indexed(maps: MapSet, scale: ScaleRange, settings: MultimapSettings) -> bool:
    return len(maps) >= settings.selection.min_indexed_maps and maps.metric and scale == ScaleRange.known()


def _with_priors(
    cells: PairLikelihood,
    expected: Mapping[tuple[str, str], Expected],
    names: Sequence[str],
    frames: Sequence[LocalFrame],
    contradiction: float,
) -> PairLikelihood:
    """Return the log-odds of the cells, and of the ``contradiction`` where a pose contradicts a prior."""
    if not expected:
        return cells

    def log_odds(target: int, source: int, target_from_source: Similarity2) -> float:
        prior = expected.get((names[target], names[source]))
        metric = frames[target].metres_from_local @ target_from_source @ frames[source].metres_from_local.inverse()
        if prior is not None and not prior.allows(metric):
            return contradiction
        return cells(target, source, target_from_source)

    return log_odds


def in_wide_cells(settings: MergeSettings) -> PreparationSettings:
    """Return the settings by which the maps of a large team are prepared to compare many poses."""
    return replace(settings.preparation, max_cells=settings.multimap.selection.index_cells)


def local_frames(maps: MapSet, cache: FeatureCache) -> list[LocalFrame]:
    """Return the local frame of every map."""
    found = []
    for grid in maps.grids:
        prepared = cache.prepared(grid)
        middle = Similarity2(float(prepared.middle[0]), float(prepared.middle[1]))
        metres_from_local = metres_from_prepared(grid.frame, prepared) @ middle
        area = int(np.count_nonzero(prepared.grid.known))
        found.append(LocalFrame(metres_from_local, max(1.0, prepared.diagonal), area))
    return found


def _in_canonical_order(maps: MapSet) -> MapSet:
    order = sorted(range(len(maps)), key=lambda k: (CanonicalOrder(maps.grids[k]), maps.grids[k].frame.resolution))
    return MapSet(
        tuple(maps.names[k] for k in order),
        tuple(maps.grids[k] for k in order),
        tuple(maps.units[k] for k in order),
        maps.resolutions_trusted,
        maps.provenance,
    )
