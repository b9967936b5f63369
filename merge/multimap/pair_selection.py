"""Selection of the pairs of a large team that are worth matching, by a coarse search."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.seeds import Role, stream
from merge.multimap.graph import Cluster, Pair, in_matching_order
from merge.multimap.team import Answers, Team
from merge.pair.feature_cache import FeatureCache, cell_width, prepare_map
from merge.pair.task import CanonicalOrder, PairTask
from merge.retrieval.similar_places import place_scores
from merge.retrieval.wall_patches import WallPatches, describe_walls
from merge.settings import MergeSettings
from merge.verification.wall_overlap import measure_wall_overlap


def score_all(team: Team, known: Answers) -> NDArray[np.float64] | None:
    """Score all pairs that are not known yet by a coarse search, or all pairs by an index: (N, N), symmetric.

    None for a team so small that all its pairs are matched.
    """
    settings = team.settings.multimap.selection
    if len(team.maps) <= settings.partners + 1:
        return None
    if team.indexed:
        return index_scores(team)
    scores = np.zeros((len(team.maps), len(team.maps)))
    blocks = in_blocks((pair for pair in team.pairs if pair not in known), settings.block_maps)
    tasks = [tuple(map(team.task, block)) for block in blocks]
    for block, values in zip(blocks, team.run(coarse_scores, tasks), strict=True):
        for pair, value in zip(block, values, strict=True):
            scores[pair] = scores[pair[::-1]] = value
    return scores


def index_scores(team: Team) -> NDArray[np.float64]:
    """Score how likely maps show the same place: (N, N), symmetric; 0 for pairs that share no similar patches."""
    tasks = [DescribeTask(grid, team.settings) for grid in team.maps.grids]
    return np.asarray(place_scores(team.run(describe, tasks), team.settings.multimap.retrieval).toarray())


def rescored(team: Team, scores: NDArray[np.float64], pairs: Sequence[Pair]) -> NDArray[np.float64]:
    """Multiply the scores of pairs by the square of those of the coarse search: (N, N), 0 for all other pairs."""
    size = team.settings.multimap.selection.block_maps
    ordered = in_matching_order(pairs)
    blocks = [ordered[first : first + size] for first in range(0, len(ordered), size)]
    found = np.zeros_like(scores)
    for block, values in zip(
        blocks, team.run(coarse_scores, [tuple(map(team.task, block)) for block in blocks]), strict=True
    ):
        for pair, value in zip(block, values, strict=True):
            found[pair] = found[pair[::-1]] = scores[pair] * value**2
    return found


@dataclass(frozen=True, eq=False)
class DescribeTask:
    """A map to describe for the index."""

    grid: OccupancyGrid
    settings: MergeSettings


def describe(task: DescribeTask, cache: FeatureCache | None = None) -> WallPatches:
    """Describe the wall patches of a map."""
    prepared = prepare_map(task.grid, task.settings.preparation)
    cell = task.grid.frame.resolution * cell_width(prepared)
    return describe_walls(prepared, cell, task.settings.multimap.retrieval.patches)


def select(
    team: Team, scores: NDArray[np.float64] | None, known: Answers, clusters: Sequence[Cluster] | None = None
) -> list[Pair]:
    """Select the pairs to match next: of those without an answer, and between clusters if there are any, the best."""
    settings = team.settings.multimap.selection
    wanted = [pair for pair in team.pairs if pair not in known]
    if team.indexed and scores is not None:
        wanted = [pair for pair in wanted if scores[pair] > 0.0]
        if clusters is None:
            candidates = best_partners(scores, wanted, settings.candidates * settings.indexed_partners)
            return best_partners(rescored(team, scores, candidates), candidates, settings.indexed_partners)
        candidates = best_bridges(scores, wanted, clusters, settings.bridges, settings.candidates)
        return best_bridges(rescored(team, scores, candidates), candidates, clusters, settings.bridges)
    if clusters is not None:
        root_of = {member: cluster.root for cluster in clusters for member in cluster.poses}
        wanted = [(a, b) for a, b in wanted if root_of[a] != root_of[b]]
    return wanted if scores is None else best_partners(scores, wanted, settings.partners)


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


def best_bridges(
    scores: NDArray[np.float64], wanted: Iterable[Pair], clusters: Sequence[Cluster], least: int, times: int = 1
) -> list[Pair]:
    """Select the wanted pairs between clusters that are among the best of the smaller one, in order.

    Of a cluster ``times`` as many are selected as it has maps, or as ``least`` if it has fewer. Of equals the earlier
    pairs are taken; of two clusters of one size the one with the larger root is the smaller.
    """
    cluster_of = {member: cluster for cluster in clusters for member in cluster.poses}
    left = {cluster.root: times * max(least, len(cluster.poses)) for cluster in clusters}
    kept = []
    for a, b in sorted(wanted, key=lambda pair: (-scores[pair], pair)):
        smaller, larger = sorted((cluster_of[a], cluster_of[b]), key=lambda each: (len(each.poses), -each.root))
        if smaller.root != larger.root and left[smaller.root] > 0:
            kept.append((a, b))
            left[smaller.root] -= 1
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
