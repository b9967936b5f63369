"""Selection of the pairs of a large team that are worth matching, by a coarse search."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mapping.seeds import Role, stream
from merge.multimap.graph import Cluster, Pair
from merge.multimap.place_index import indexed_poses
from merge.multimap.team import Answers, Team
from merge.pair.feature_cache import FeatureCache
from merge.pair.task import CanonicalOrder, PairTask
from merge.retrieval.relative_poses import RelativePoses
from merge.verification.wall_overlap import measure_wall_overlap


@dataclass(frozen=True, eq=False)
class Ranking:
    """How likely pairs match: ``scores`` (N, N), symmetric, and for an indexed team the ``poses`` that have them."""

    scores: NDArray[np.float64]
    poses: RelativePoses | None = None


def rank_pairs(team: Team, known: Answers) -> Ranking | None:
    """Score all pairs that are not known yet by a coarse search, or by an index all pairs that it suggests.

    None for a team so small that all its pairs are matched.
    """
    settings = team.settings.multimap.selection
    if len(team.maps) <= settings.partners + 1:
        return None
    if team.indexed:
        poses = indexed_poses(team)
        return Ranking(np.asarray(poses.best_scores(len(team.maps)).toarray()), poses)
    scores = np.zeros((len(team.maps), len(team.maps)))
    blocks = in_blocks((pair for pair in team.pairs if pair not in known), settings.block_maps)
    tasks = [tuple(map(team.task, block)) for block in blocks]
    for block, values in zip(blocks, team.run(coarse_scores, tasks), strict=True):
        for pair, value in zip(block, values, strict=True):
            scores[pair] = scores[pair[::-1]] = value
    return Ranking(scores)


def select(
    team: Team, ranking: Ranking | None, known: Answers, clusters: Sequence[Cluster] | None = None
) -> list[Pair]:
    """Select the pairs to match next: of those without an answer, and between clusters if there are any, the best."""
    settings = team.settings.multimap.selection
    wanted = [pair for pair in team.pairs if pair not in known]
    if clusters is not None:
        root_of = {member: cluster.root for cluster in clusters for member in cluster.poses}
        wanted = [(a, b) for a, b in wanted if root_of[a] != root_of[b]]
    if ranking is None:
        return wanted
    if ranking.poses is None:
        return best_partners(ranking.scores, wanted, settings.partners)
    suggested = [pair for pair in wanted if ranking.scores[pair] > 0.0]
    return best_partners(ranking.scores, suggested, settings.indexed_partners)


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


def nearest_partners(team: Team, cluster: Cluster, wanted: Sequence[Pair]) -> list[Pair]:
    """Select the wanted pairs of a cluster until each map has ``guided_partners``, the nearest for their size first."""
    partners = np.zeros(len(team.maps), dtype=int)
    for edge in cluster.edges:
        partners[[edge.target, edge.source]] += 1
    diagonals = [frame.diagonal for frame in team.frames]

    def distance(pair: Pair) -> float:
        between = cluster.target_from_source(*pair)
        return math.hypot(between.x, between.y) / (diagonals[pair[0]] + between.scale * diagonals[pair[1]])

    kept = []
    for pair in sorted(wanted, key=lambda pair: (distance(pair), pair)):
        if min(partners[list(pair)]) < team.settings.multimap.selection.guided_partners:
            kept.append(pair)
            partners[list(pair)] += 1
    return sorted(kept)
