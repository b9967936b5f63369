"""Selection of the pairs of a large team that are worth matching, by a coarse search."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.seeds import Role, stream
from merge.alignment.hypotheses import rank_proposals, ranked
from merge.multimap.graph import Cluster, Pair
from merge.multimap.team import Answers, Team
from merge.pair.feature_cache import FeatureCache, metres_from_prepared, prepare_map
from merge.pair.task import CanonicalOrder, PairTask
from merge.preparation.prepared_map import PreparedMap
from merge.records.proposal import Proposal
from merge.retrieval.relative_poses import RelativePoses
from merge.retrieval.similar_places import suggest_poses
from merge.retrieval.wall_patches import WallPatches, describe_walls
from merge.settings import MergeSettings
from merge.verification.wall_overlap import mean_score, measure_wall_overlap, measure_wall_overlap_by_tolerance


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


def indexed_poses(team: Team) -> RelativePoses:
    """Score how well the walls of two maps fit by the poses that the index suggests, each moved to the walls nearby."""
    settings = team.settings.multimap
    described = team.run(describe, [DescribeTask(grid, team.settings) for grid in team.maps.grids])
    poses = suggest_poses(described, settings.retrieval)
    tasks = [
        PlacesTask({int(k): team.maps.grids[k] for k in {*part.targets, *part.sources}}, part, team.settings)
        for part in _in_pose_blocks(poses, settings.selection.index_block_maps)
    ]
    return RelativePoses.joined(team.run(score_places, tasks))


def _in_pose_blocks(poses: RelativePoses, maps: int) -> list[RelativePoses]:
    """Group poses to blocks of so many maps by so many."""
    _, block = np.unique(np.stack((poses.targets // maps, poses.sources // maps)), axis=1, return_inverse=True)
    return [poses[np.flatnonzero(block.ravel() == k)] for k in range(int(block.max(initial=-1)) + 1)]


@dataclass(frozen=True, eq=False)
class PlacesTask:
    """Maps by index, and poses between them to score."""

    grids: Mapping[int, OccupancyGrid]
    poses: RelativePoses
    settings: MergeSettings


def score_places(task: PlacesTask, cache: FeatureCache | None = None) -> RelativePoses:
    """Move the poses to the walls nearby, and score how well those fit, on coarse cells."""
    maps = {index: CoarseMap.of(grid, task.settings) for index, grid in sorted(task.grids.items())}
    starts = [*task.poses.first_of_pairs().tolist(), len(task.poses)]
    rows: list[tuple[int, int, Similarity2, float]] = []
    for first, last in pairwise(starts):
        a, b = int(task.poses.targets[first]), int(task.poses.sources[first])
        target, source = maps[a], maps[b]
        poses = task.poses.target_from_source[np.arange(first, last)].similarities()
        proposals = [Proposal(target.metres.inverse() @ pose @ source.metres) for pose in poses]
        scale = source.metres.scale / target.metres.scale
        found = rank_proposals(
            target.prepared, source.prepared, proposals, ScaleRange(scale, scale), task.settings.alignment
        )
        for each in ranked(found):
            metric = target.metres @ each.target_from_source @ source.metres.inverse()
            rows.append((a, b, metric, each.mean_score))
    targets, sources, moved, scores = zip(*rows, strict=True) if rows else ((), (), (), ())
    return RelativePoses(
        np.array(targets, np.intp), np.array(sources, np.intp), Similarity2Array.of(moved), np.array(scores, np.float64)
    )


@dataclass(frozen=True, eq=False)
class CoarseMap:
    """A map in wide cells; ``metres`` leads from those to metres of the map."""

    prepared: PreparedMap
    metres: Similarity2

    @staticmethod
    def of(grid: OccupancyGrid, settings: MergeSettings) -> CoarseMap:
        cells = replace(settings.preparation, max_cells=settings.multimap.selection.index_cells)
        prepared = prepare_map(grid, cells)
        return CoarseMap(prepared, metres_from_prepared(grid.frame, prepared))


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
    if clusters is not None:
        return select_bridges(team, ranking.poses, set(wanted), clusters)
    return best_partners(
        ranking.scores, [pair for pair in wanted if ranking.scores[pair] > 0], settings.indexed_partners
    )


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


def select_bridges(
    team: Team, poses: RelativePoses, wanted: Collection[Pair], clusters: Sequence[Cluster]
) -> list[Pair]:
    """Select wanted pairs between clusters, of the alignments of two clusters whose walls fit best all over.

    A map looks like many places of a large building. Two clusters, laid over one another as one of those says, meet in
    many maps, and only in the right place do all of them fit. So of each cluster the likeliest alignments with others
    are measured on all maps that then meet, and of the best ones the pairs matched that have most in common.
    """
    settings = team.settings.multimap.selection
    maps: dict[int, CoarseMap] = {}
    measured = sorted(
        (_measured(team, each, maps) for each in _bridges(team, poses, clusters)), key=lambda each: -each.score
    )
    left = {cluster.root: settings.bridges for cluster in clusters}
    chosen: set[Pair] = set()
    for bridge in measured:
        pairs = [pair for pair in bridge.pairs if pair in wanted and pair not in chosen]
        smaller = smaller_cluster(bridge.first, bridge.second)
        if pairs and left[smaller.root] > 0:
            chosen.update(pairs[: settings.bridge_pairs])
            left[smaller.root] -= 1
    return sorted(chosen)


@dataclass(frozen=True, eq=False)
class Bridge:
    """An alignment of two clusters; ``pairs`` are those that then meet, those with most in common first."""

    first: Cluster
    second: Cluster
    first_from_second: Similarity2
    score: float
    pairs: tuple[Pair, ...] = ()


def smaller_cluster(first: Cluster, second: Cluster) -> Cluster:
    """Return the cluster of fewer maps; of two of one size that with the larger root."""
    return min(first, second, key=lambda each: (len(each.poses), -each.root))


def _bridges(team: Team, poses: RelativePoses, clusters: Sequence[Cluster]) -> list[Bridge]:
    """List the likeliest distinct alignments of clusters, by their best pose of two maps."""
    settings = team.settings.multimap.selection
    cluster_of = {member: cluster for cluster in clusters for member in cluster.poses}
    left = {each.root: max(settings.bridge_candidates, len(each.poses)) for each in clusters}
    found: dict[Pair, list[Bridge]] = {}
    root_of = np.array([cluster_of[k].root for k in range(len(team.maps))])
    across = np.flatnonzero(root_of[poses.targets] != root_of[poses.sources])
    for k in across[np.argsort(-poses.scores[across], kind="stable")].tolist():
        a, b = int(poses.targets[k]), int(poses.sources[k])
        first, second = sorted((cluster_of[a], cluster_of[b]), key=lambda each: each.root)
        smaller = smaller_cluster(first, second)
        if left[smaller.root] == 0:
            continue
        (metric,) = poses.target_from_source[np.array([k])].similarities()
        between = team.local(metric, a, b)
        if a not in first.poses:
            a, b, between = b, a, between.inverse()
        place = first.poses[a] @ between @ second.poses[b].inverse()
        others = found.setdefault((first.root, second.root), [])
        if all(_apart(team, place, each.first_from_second, first, second, b) for each in others):
            others.append(Bridge(first, second, place, float(poses.scores[k])))
            left[smaller.root] -= 1
    return [bridge for bridges in found.values() for bridge in bridges]


def _apart(team: Team, place: Similarity2, other: Similarity2, first: Cluster, second: Cluster, member: int) -> bool:
    """Test if two alignments put a map of the second cluster at different places."""
    radius = team.frames[member].diagonal / 2.0
    moved = (other @ second.poses[member]).inverse() @ place @ second.poses[member]
    shift = math.hypot(moved.x, moved.y) + radius * abs(moved.yaw)
    return shift > 2.0 * team.settings.alignment.hypotheses.distinct_share * team.frames[member].diagonal


def _measured(team: Team, bridge: Bridge, maps: dict[int, CoarseMap]) -> Bridge:
    """Measure an alignment on all pairs of maps that then meet."""
    alignment, points = team.settings.alignment, team.settings.multimap.selection.coarse_points
    placed = {b: bridge.first_from_second @ pose for b, pose in bridge.second.poses.items()}
    levels = len(alignment.overlap.tolerance_shares)
    inliers, compared = np.zeros(levels), np.zeros(levels)
    pairs: list[tuple[float, Pair]] = []
    for a, b in team.model.neighbours(bridge.first.poses, placed):
        between = bridge.first.poses[a].inverse() @ placed[b]
        metric = team.frames[a].metres_from_local @ between @ team.frames[b].metres_from_local.inverse()
        for k in (a, b):
            if k not in maps:
                maps[k] = CoarseMap.of(team.maps.grids[k], team.settings)
        cells = maps[a].metres.inverse() @ metric @ maps[b].metres
        walls = measure_wall_overlap_by_tolerance(maps[a].prepared, maps[b].prepared, cells, points, alignment.overlap)
        inliers += [each.inlier_length for each in walls]
        compared += [each.compared_length for each in walls]
        score = mean_score(walls)
        if score > 0.0:
            pairs.append((-score, (min(a, b), max(a, b))))
    fits = float(np.mean((inliers / np.maximum(compared, 1.0)) ** 2))
    return replace(bridge, score=bridge.score * fits, pairs=tuple(pair for _, pair in sorted(pairs)))


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
