"""Selection of the pairs of a large team that are worth matching, by a coarse search."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.seeds import Role, stream
from merge.alignment.hypotheses import rank_proposals
from merge.multimap.graph import Cluster, Pair
from merge.multimap.team import Answers, Team
from merge.pair.feature_cache import FeatureCache, metres_from_prepared, prepare_map
from merge.pair.task import CanonicalOrder, PairTask
from merge.records.proposal import Proposal
from merge.retrieval.similar_places import SuggestedPoses, suggest_poses
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
    """Score how well the walls of two maps fit by a pose that the index suggests: (N, N), symmetric; 0 without one."""
    settings = team.settings.multimap
    described = team.run(describe, [DescribeTask(grid, team.settings) for grid in team.maps.grids])
    poses = suggest_poses(described, settings.retrieval)
    tasks = [
        PlacesTask({int(k): team.maps.grids[k] for k in {*part.targets, *part.sources}}, part, team.settings)
        for part in _in_pose_blocks(poses, settings.selection.index_block_maps)
    ]
    scores = np.zeros((len(team.maps), len(team.maps)))
    for task, values in zip(tasks, team.run(score_places, tasks), strict=True):
        rows = task.poses.targets, task.poses.sources
        np.maximum.at(scores, rows, values)
        np.maximum.at(scores, rows[::-1], values)
    return scores


def _in_pose_blocks(poses: SuggestedPoses, maps: int) -> list[SuggestedPoses]:
    """Group poses to blocks of so many maps by so many."""
    _, block = np.unique(np.stack((poses.targets // maps, poses.sources // maps)), axis=1, return_inverse=True)
    return [poses[np.flatnonzero(block.ravel() == k)] for k in range(int(block.max(initial=-1)) + 1)]


@dataclass(frozen=True, eq=False)
class PlacesTask:
    """Maps by index, and poses between them to score."""

    grids: Mapping[int, OccupancyGrid]
    poses: SuggestedPoses
    settings: MergeSettings


def score_places(task: PlacesTask, cache: FeatureCache | None = None) -> NDArray[np.float64]:
    """Score the walls of each pair (P,) by the best of its poses, each moved to the walls nearby, in coarse cells."""
    preparation = replace(task.settings.preparation, max_cells=task.settings.multimap.selection.index_cells)
    prepared = {index: prepare_map(grid, preparation) for index, grid in sorted(task.grids.items())}
    metres = {index: metres_from_prepared(task.grids[index].frame, each) for index, each in prepared.items()}
    scores = np.zeros(len(task.poses))
    pairs = np.stack((task.poses.targets, task.poses.sources))
    starts = np.flatnonzero(np.r_[True, (np.diff(pairs) != 0).any(axis=0)])
    for first, last in pairwise([*starts.tolist(), len(task.poses)]):
        a, b = pairs[:, first].tolist()
        proposals = [
            Proposal(metres[a].inverse() @ pose @ metres[b])
            for pose in task.poses.target_from_source[np.arange(first, last)].similarities()
        ]
        scale = metres[b].scale / metres[a].scale
        ranked = rank_proposals(prepared[a], prepared[b], proposals, ScaleRange(scale, scale), task.settings.alignment)
        scores[first:last] = max((each.mean_score for each in ranked), default=0.0)
    return scores


@dataclass(frozen=True, eq=False)
class DescribeTask:
    """A map to describe for the index."""

    grid: OccupancyGrid
    settings: MergeSettings


def describe(task: DescribeTask, cache: FeatureCache | None = None) -> WallPatches:
    """Describe the wall patches of a map."""
    prepared = prepare_map(task.grid, task.settings.preparation)
    metres = metres_from_prepared(task.grid.frame, prepared)
    return describe_walls(prepared, metres, task.settings.multimap.retrieval.patches)


def select(
    team: Team, scores: NDArray[np.float64] | None, known: Answers, clusters: Sequence[Cluster] | None = None
) -> list[Pair]:
    """Select the pairs to match next: of those without an answer, and between clusters if there are any, the best."""
    settings = team.settings.multimap.selection
    wanted = [pair for pair in team.pairs if pair not in known]
    if team.indexed and scores is not None:
        wanted = [pair for pair in wanted if scores[pair] > 0.0]
        if clusters is None:
            return best_partners(scores, wanted, settings.indexed_partners)
        return best_bridges(scores, wanted, clusters, settings.bridges)
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
    scores: NDArray[np.float64], wanted: Iterable[Pair], clusters: Sequence[Cluster], least: int
) -> list[Pair]:
    """Select the wanted pairs between clusters that are among the best of the smaller one, in order.

    Of a cluster as many are selected as it has maps, or ``least`` if it has fewer. Of equals the earlier pairs are
    taken; of two clusters of one size the one with the larger root is the smaller.
    """
    cluster_of = {member: cluster for cluster in clusters for member in cluster.poses}
    left = {cluster.root: max(least, len(cluster.poses)) for cluster in clusters}
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
