"""The entry points of the merger."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import combinations

from mapping.map_set import MapSet
from merge.multimap.pipeline import solve
from merge.multimap.results import merge_result
from merge.multimap.team import Team
from merge.pair.feature_cache import FeatureCache
from merge.pair.matching import PairTask, Runner, match, run_tasks
from merge.records.result import MergeResult, PairResult
from merge.settings import MergeSettings

Progress = Callable[[int, int], None]
"""Called with the number of pairs done and the number of pairs."""


def merge_maps(
    maps: MapSet,
    settings: MergeSettings = MergeSettings(),
    seed: int = 0,
    on_progress: Progress | None = None,
    runner: Runner | None = None,
    answers: Mapping[tuple[str, str], PairResult] | None = None,
) -> MergeResult:
    """Find the transforms between the maps of a team, accept or refuse each, and fuse the maps that join.

    ``settings.method`` proposes transforms; verification, refinement and acceptance are common to all methods. Of a
    large team the best pairs are matched until all maps are joined. Answers that contradict the others are refused,
    pairs that the others predict are matched again, and the poses and scales of a cluster are refined together on the
    cells. Each cluster is fused in the frame of one map.

    The same maps, settings and seed give the same result, in any order of the maps and with any number of workers of
    the ``runner``. Maps that do not match are no error: their pair is refused with a reason. ``answers``, by target
    and source, are those of pairs that were matched before.

    Raises ``ValueError`` if the seed is negative, or a setting names an unknown map.
    """
    _check_names(maps, settings)
    team = Team.of(maps, settings, seed, on_progress, runner)
    known = {team.pair(*names): answer for names, answer in (answers or {}).items() if set(names) <= set(maps.names)}
    return merge_result(team, solve(team, known))


def match_maps(
    maps: MapSet,
    settings: MergeSettings = MergeSettings(),
    seed: int = 0,
    on_progress: Progress | None = None,
) -> tuple[PairResult, ...]:
    """Match every pair by itself: answers of other pairs change nothing, and no maps are fused."""
    scale = settings.scale if settings.scale is not None else maps.scale_range
    tasks = [PairTask.of(maps, a, b, scale, settings, seed) for a, b in combinations(range(len(maps)), 2)]
    cache = FeatureCache(settings.preparation, kept=max(2, math.isqrt(2 * len(tasks)) + 2))
    done = iter(range(1, len(tasks) + 1))

    def step() -> None:
        if on_progress is not None:
            on_progress(next(done), len(tasks))

    return tuple(run_tasks(match, tasks, cache, None, step))


def _check_names(maps: MapSet, settings: MergeSettings) -> None:
    named = [("reference", settings.reference)] if settings.reference is not None else []
    for option, name in [*named, *(("prior", prior.name) for prior in settings.priors)]:
        if name not in maps.names:
            raise ValueError(f"{option} is {name!r}, must be the name of a map: {', '.join(maps.names)}")
