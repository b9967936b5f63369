"""The merge of a team of maps."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from itertools import combinations

from mapping.geometry.scale_range import ScaleRange
from mapping.map_set import MapSet
from merge.multimap.results import merge_result
from merge.multimap.team import Team
from merge.pair.feature_cache import FeatureCache
from merge.pair.matching import PairTask, match, run_tasks
from merge.records.result import MergeResult, PairResult
from merge.settings import MergeSettings

Progress = Callable[[int, int], None]
"""Called with the number of pairs done and the number of pairs."""

Answers = Mapping[tuple[str, str], PairResult]


def merge_maps(
    maps: MapSet,
    settings: MergeSettings = MergeSettings(),  # noqa: B008
    seed: int = 0,
    on_progress: Progress | None = None,
    executor: Executor | None = None,
    answers: Answers | None = None,
) -> MergeResult:
    """Find the transforms between the maps of a team, say which to believe, and join those maps in one grid.

    Pairs are proposed by ``settings.method``, then verified, refined and decided by what is common to all methods; of
    a large team those pairs that promise most, until all maps are joined. Answers that the others contradict are put
    aside, refused ones that the others explain won back, and all poses and scales of a group refined together on the
    cells; each group is fused in the frame of one map. The same maps, settings and seed give the same result, in any
    order of the maps and however many workers the ``executor`` has; maps that do not match are no error: their pair is
    refused with a reason. ``answers`` are pairs, by names, that were matched before and are taken as they are. Raises
    ``ValueError`` where the seed is negative, or a setting names a map that is not there.
    """
    _check_names(maps, settings)
    team = Team(maps, settings, seed, on_progress, executor, answers or {})
    groups = team.solve()
    return merge_result(team, groups)


def match_maps(
    maps: MapSet,
    settings: MergeSettings = MergeSettings(),  # noqa: B008
    seed: int = 0,
    on_progress: Progress | None = None,
) -> tuple[PairResult, ...]:
    """The answer of every pair by itself: nothing is chained or fused, and no pair hears of another."""
    scale = settings.scale if settings.scale is not None else ScaleRange.automatic(maps)
    tasks = [PairTask.of(maps, a, b, scale, settings, seed) for a, b in combinations(range(len(maps)), 2)]
    done = iter(range(1, len(tasks) + 1))

    def step() -> None:
        if on_progress is not None:
            on_progress(next(done), len(tasks))

    return tuple(run_tasks(match, tasks, FeatureCache(max(2, math.isqrt(2 * len(tasks)) + 2)), None, step))


def _check_names(maps: MapSet, settings: MergeSettings) -> None:
    named = [("reference", settings.reference)] if settings.reference is not None else []
    for what, name in [*named, *(("prior", prior.name) for prior in settings.priors)]:
        if name not in maps.names:
            raise ValueError(f"{what} is {name!r}, no map is called that; the maps are {', '.join(maps.names)}")
