"""Which pairs of a large team are worth matching, told cheaply."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from mapping.seeds import Role, stream
from merge.pair.feature_cache import FeatureCache
from merge.pair.matching import PairTask, canonical_order, process_feature_cache
from merge.proposers.normal_correlation import NormalCorrelation
from merge.verification.wall_overlap import measure_wall_overlap

GLANCE = NormalCorrelation(scale_step=1.12, across=48, peaks=2, proposals=6)
"""A search so coarse that it costs a twentieth of a match: it orders pairs, and judges none."""

GLANCE_POINTS = 400

PARTNERS = 5
"""Each map is matched with so many others that promise most, and again with as many where it was not joined."""

BLOCK = 10
"""Pairs are looked at in blocks of so many maps by so many, so that a map is not sent to a worker for each."""

Pair = tuple[int, int]


def promise(task: PairTask, shelf: FeatureCache | None = None) -> float:
    """How well the walls agree at the best place of a coarse search, 0 to 1, whichever map comes first."""
    target, source = task.sheets(shelf or process_feature_cache(), (GLANCE,))
    scale = task.in_cells(task.scale, (target, source))
    if canonical_order(target.chart.grid) > canonical_order(source.chart.grid):
        target, source, scale = source, target, scale.inverse()
    if not (len(target.chart.points) and len(source.chart.points)):
        return 0.0
    places = GLANCE.propose(target.descriptions[0], source.descriptions[0], scale, stream(task.seed, Role.MERGE))
    laid = (
        measure_wall_overlap(target.chart, source.chart, place.target_from_source, GLANCE_POINTS).score
        for place in places
    )
    return max(laid, default=0.0)


def promises(tasks: Sequence[PairTask], shelf: FeatureCache | None = None) -> list[float]:
    """Of each pair."""
    return [promise(task, shelf) for task in tasks]


def in_blocks(pairs: Iterable[Pair]) -> list[list[Pair]]:
    """The pairs by blocks of their maps."""
    blocks: dict[Pair, list[Pair]] = {}
    for a, b in pairs:
        blocks.setdefault((a // BLOCK, b // BLOCK), []).append((a, b))
    return list(blocks.values())


def in_order(pairs: Sequence[Pair]) -> list[Pair]:
    """The pairs so that those of a map, and of the maps that it is matched with, follow one another: what was made of
    them is then still at hand (Cuthill and McKee 1969)."""
    if not pairs:
        return []
    ends = np.array(pairs).T
    number = int(ends.max()) + 1
    graph = csr_array((np.ones(2 * len(pairs)), np.hstack((ends, ends[::-1]))), shape=(number, number))
    rank = np.argsort(reverse_cuthill_mckee(graph, symmetric_mode=True))
    return sorted(pairs, key=lambda pair: sorted(rank[list(pair)].tolist()))


def partners(promises: NDArray[np.float64], wanted: Iterable[Pair], most: int = PARTNERS) -> list[Pair]:
    """Of the wanted pairs those that are among the ``most`` most promising of either map, in order.

    ``promises`` (N, N) is symmetric; of equals the earlier pairs are taken.
    """
    candidates = sorted(wanted, key=lambda pair: (-promises[pair], pair))
    taken = np.zeros(len(promises), dtype=int)
    kept = []
    for pair in candidates:
        if min(taken[list(pair)]) < most:
            kept.append(pair)
            taken[list(pair)] += 1
    return sorted(kept)


def apart(groups: Sequence[Sequence[int]]) -> list[Pair]:
    """All pairs of maps that lie in two groups, lower first."""
    group_of = {member: index for index, group in enumerate(groups) for member in group}
    members = sorted(group_of)
    return [(a, b) for a in members for b in members if a < b and group_of[a] != group_of[b]]
