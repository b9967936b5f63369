"""Selection of the pairs of a large team that are worth matching, by a coarse search."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from mapping.seeds import Role, stream
from merge.multimap.graph import Cluster, Pair
from merge.multimap.team import Answers, Team
from merge.pair.feature_cache import FeatureCache
from merge.pair.task import CanonicalOrder, PairTask
from merge.verification.wall_overlap import measure_wall_overlap


def score_all(team: Team, known: Answers) -> NDArray[np.float64] | None:
    """Score all pairs that are not known yet by a coarse search: (N, N), symmetric.

    None for a team so small that all its pairs are matched.
    """
    settings = team.settings.multimap.selection
    if len(team.maps) <= settings.partners + 1:
        return None
    scores = np.zeros((len(team.maps), len(team.maps)))
    blocks = in_blocks((pair for pair in team.pairs if pair not in known), settings.block_maps)
    tasks = [tuple(map(team.task, block)) for block in blocks]
    for block, values in zip(blocks, team.run(coarse_scores, tasks), strict=True):
        for pair, value in zip(block, values, strict=True):
            scores[pair] = scores[pair[::-1]] = value
    return scores


def select(
    team: Team, scores: NDArray[np.float64] | None, known: Answers, clusters: Sequence[Cluster] | None = None
) -> list[Pair]:
    """Select the pairs to match next: of those without an answer, and between clusters if there are any, the best."""
    wanted = [pair for pair in team.pairs if pair not in known]
    if clusters is not None:
        root_of = {member: cluster.root for cluster in clusters for member in cluster.poses}
        wanted = [(a, b) for a, b in wanted if root_of[a] != root_of[b]]
    return wanted if scores is None else best_partners(scores, wanted, team.settings.multimap.selection.partners)


def coarse_scores(tasks: Sequence[PairTask], cache: FeatureCache | None = None) -> list[float]:
    """Score each pair by its best pose of a coarse search, 0 to 1, whichever map comes first."""
    return [_coarse_score(task, cache) for task in tasks]


def _coarse_score(task: PairTask, cache: FeatureCache | None) -> float:
    settings = task.settings.multimap.selection
    base = task.settings.proposers.normal_correlation
    cells, peaks = settings.coarse_cells, settings.coarse_peaks
    search = replace(
        base,
        scale_step=settings.coarse_scale_step,
        proposals=settings.coarse_proposals,
        fine=replace(base.fine, cells=cells, peaks=peaks),
        coarse=replace(base.coarse, cells=cells // 2, peaks=peaks),
    )
    target, source = task.features(cache, (search,))
    scale = task.in_cells(task.scale, (target, source))
    if CanonicalOrder(target.prepared.grid) > CanonicalOrder(source.prepared.grid):
        target, source, scale = source, target, scale.inverse()
    if not (len(target.prepared.points) and len(source.prepared.points)):
        return 0.0
    rng = stream(task.seed, Role.MERGE)
    proposals = search.propose(target.descriptions[0], source.descriptions[0], scale, rng)
    points, overlap = settings.coarse_points, task.settings.alignment.overlap
    scores = (
        measure_wall_overlap(target.prepared, source.prepared, proposal.target_from_source, points, overlap).score
        for proposal in proposals
    )
    return max(scores, default=0.0)


def in_blocks(pairs: Iterable[Pair], maps: int) -> list[list[Pair]]:
    """Group the pairs to blocks of so many maps by so many."""
    blocks: dict[Pair, list[Pair]] = {}
    for a, b in pairs:
        blocks.setdefault((a // maps, b // maps), []).append((a, b))
    return list(blocks.values())


def in_matching_order(pairs: Sequence[Pair]) -> list[Pair]:
    """Order the pairs so that those of a map and of its partners follow one another.

    Their features are then still in the cache. Source: Cuthill and McKee 1969.
    """
    if not pairs:
        return []
    ends = np.array(pairs).T
    number = int(ends.max()) + 1
    graph = csr_array((np.ones(2 * len(pairs)), np.hstack((ends, ends[::-1]))), shape=(number, number))
    rank = np.argsort(reverse_cuthill_mckee(graph, symmetric_mode=True))
    return sorted(pairs, key=lambda pair: sorted(rank[list(pair)].tolist()))


def best_partners(scores: NDArray[np.float64], wanted: Iterable[Pair], most: int) -> list[Pair]:
    """Select the wanted pairs that are among the ``most`` best of either map, in order.

    ``scores`` (N, N) is symmetric; of equals the earlier pairs are taken.
    """
    candidates = sorted(wanted, key=lambda pair: (-scores[pair], pair))
    taken = np.zeros(len(scores), dtype=int)
    kept = []
    for pair in candidates:
        if min(taken[list(pair)]) < most:
            kept.append(pair)
            taken[list(pair)] += 1
    return sorted(kept)
