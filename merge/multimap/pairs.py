"""The pairs of a team: which are matched, and what became of each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from itertools import combinations
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.map_set import MapSet
from merge.multimap.cluster import Cluster
from merge.multimap.guided_matching import NearTask, match_near, refused, won
from merge.multimap.pair_selection import PARTNERS, Pair, apart, in_blocks, in_order, partners, promises
from merge.pair.feature_cache import FeatureCache
from merge.pair.matching import PairTask, canonical_order, match, run_tasks
from merge.records.prior import Expected, expected_places
from merge.records.reason import Reason
from merge.records.result import PairResult
from merge.settings import MergeSettings

Task = TypeVar("Task")
Result = TypeVar("Result")


class Pairs:
    """Maps in the order of what they hold, so that nothing depends on the order in which they came.

    ``answers`` has what became of each pair so far, by indices in that order, lower first; ``maps`` are in it.
    """

    def __init__(
        self,
        maps: MapSet,
        settings: MergeSettings,
        seed: int,
        on_progress: Callable[[int, int], None] | None,
        executor: Executor | None,
        answers: Mapping[tuple[str, str], PairResult],
    ) -> None:
        self.names = maps.names
        self.maps = _ordered(maps)
        self.settings, self.seed, self.executor = settings, seed, executor
        self.scale = settings.scale if settings.scale is not None else ScaleRange.automatic(maps)
        self.shelf = FeatureCache()
        self.answers: dict[Pair, PairResult] = {}
        self.expected: dict[tuple[str, str], Expected] = expected_places(settings.priors, settings.reference)
        self._place_of_name = {name: index for index, name in enumerate(self.maps.names)}
        self._on_progress, self._done, self._planned = on_progress, 0, 0
        for (target, source), answer in answers.items():
            if target in self._place_of_name and source in self._place_of_name:
                self.answers[self.pair_of(target, source)] = answer

    def task(self, pair: Pair) -> PairTask:
        """A pair to match, its maps in the order in which they came."""
        first, second = sorted(pair, key=lambda index: self.names.index(self.maps.names[index]))
        return PairTask.of(self.maps, first, second, self.scale, self.settings, self.seed)

    def pair_of(self, target: str, source: str) -> Pair:
        a, b = self._place_of_name[target], self._place_of_name[source]
        return min(a, b), max(a, b)

    def place(self, name: str) -> int:
        """The index of a map."""
        return self._place_of_name[name]

    @property
    def trusted(self) -> bool:
        """Whether the resolutions that the maps state are true."""
        return self.maps.resolutions_trusted and all(unit == "m" for unit in self.maps.units)

    def pairs(self) -> list[Pair]:
        return list(combinations(range(len(self.maps)), 2))

    def match_pairs(self) -> None:
        wanted = [pair for pair in self.pairs() if pair not in self.answers]
        if len(self.maps) > PARTNERS + 1:
            self._promises = self._promised(wanted)
            wanted = partners(self._promises, wanted)
        self.match(wanted)

    def more_pairs(self, groups: Sequence[Cluster]) -> list[Pair]:
        untried = [pair for pair in apart([list(group.poses) for group in groups]) if pair not in self.answers]
        return partners(self._promises, untried) if untried else []

    def _promised(self, pairs: Sequence[Pair]) -> NDArray[np.float64]:
        found = np.zeros((len(self.maps), len(self.maps)))
        blocks = in_blocks(pairs)
        tasks = [tuple(map(self.task, block)) for block in blocks]
        for block, values in zip(blocks, self.run(promises, tasks), strict=True):
            for pair, value in zip(block, values, strict=True):
                found[pair] = found[pair[::-1]] = value
        return found

    def match(self, pairs: Sequence[Pair]) -> None:
        pairs = in_order(pairs)
        for pair, answer in zip(pairs, self.run(match, [self.task(pair) for pair in pairs]), strict=True):
            self.answers[pair] = answer
        if self.expected:
            self._hear_priors(pairs)

    def _hear_priors(self, pairs: Iterable[Pair]) -> None:
        """Refuse what contradicts the start poses; and look around them where nothing else was found."""
        open_pairs = []
        for pair in pairs:
            answer = self.answers[pair]
            expected = self.expected.get((answer.target, answer.source))
            if expected is None:
                continue
            found = answer.target_from_source
            if not answer.accepted or found is None or not expected.allows(found):
                open_pairs.append((pair, expected))
        tasks = [NearTask(self.task(pair), expected) for pair, expected in open_pairs]
        for (pair, expected), near in zip(open_pairs, self.run(match_near, tasks), strict=True):
            before, found = self.answers[pair], near.target_from_source
            if near.accepted and found is not None and expected.allows(found):
                self.answers[pair] = won(before, near, "prior")
            elif before.accepted:
                self.answers[pair] = refused(before, Reason.CONTRADICTS_PRIOR, "prior")

    def run(self, function: Callable[[Task, FeatureCache | None], Result], tasks: Sequence[Task]) -> list[Result]:
        self._planned += len(tasks)

        def step() -> None:
            self._done += 1
            if self._on_progress is not None:
                self._on_progress(self._done, self._planned)

        return run_tasks(function, tasks, self.shelf, self.executor, step)


def _ordered(maps: MapSet) -> MapSet:
    order = sorted(
        range(len(maps)), key=lambda index: (canonical_order(maps.grids[index]), maps.grids[index].frame.resolution)
    )
    return MapSet(
        tuple(maps.names[k] for k in order),
        tuple(maps.grids[k] for k in order),
        tuple(maps.units[k] for k in order),
        maps.resolutions_trusted,
        maps.provenance,
    )
