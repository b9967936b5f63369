"""Bridges: alignments by which two clusters of a large team may join.

A map looks like many places of a large building. Two clusters, laid over one another as one of those says, meet in many
maps, and only in the right place do all of them fit. How well is learned from the team itself: from the pairs that
joined, and from the many alignments that cannot all be right.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from mapping.geometry.similarity2 import Similarity2
from merge.multimap.graph import Cluster, ClusterAlignment, Edge, Pair
from merge.multimap.place_index import CoarseMap
from merge.multimap.team import Team
from merge.retrieval.relative_poses import RelativePoses
from merge.verification.wall_overlap import mean_score, measure_wall_overlap_by_tolerance

POSSIBLY_RIGHT = 3
"""Bridges of a cluster that may be right; the others cannot all be."""

MOST_ANSWERS = 4
"""Answers of an alignment that are tried as its place."""

LEAST_MISFIT = 0.001
"""Misfits far below this are noise."""

LEAST_SPREAD = 0.1
"""Least standard deviation of the logarithm of the misfit."""

QUARTILES = 1.349
"""Distance of the quartiles of a normal distribution [standard deviations]."""

LEAST_JOINED = 20
"""Pairs that must have joined before their fits say how well right alignments fit."""


@dataclass(frozen=True, eq=False)
class Bridge:
    """An alignment of two clusters.

    It places the maps ``between`` on one another, one of either. ``fit``, 0 to 1, is that of all walls that then meet
    around them: the squared share that lies on a wall of the other cluster, the mean over all tolerances. Further away
    the errors of whole clusters add up. ``pairs`` are the maps that meet, those with most in common first.
    """

    first: Cluster
    second: Cluster
    first_from_second: Similarity2
    between: Pair
    fit: float = 0.0
    pairs: tuple[Pair, ...] = ()

    @property
    def smaller(self) -> Cluster:
        """The cluster of fewer maps; of two of one size that with the larger root."""
        return min(self.first, self.second, key=lambda each: (len(each.poses), -each.root))


class BridgeSearch:
    """Find and measure alignments of clusters, from the relative ``poses`` that the index suggests."""

    def __init__(self, team: Team, poses: RelativePoses) -> None:
        self._team, self._poses = team, poses
        self._maps: dict[int, CoarseMap] = {}
        self._first: list[tuple[Bridge, bool]] = []

    def find(self, clusters: Sequence[Cluster]) -> list[Bridge]:
        """List the likeliest distinct alignments of each cluster with larger ones, those that fit best first."""
        found = [self.measured(each) for each in self._likeliest(clusters)]
        return sorted(found, key=lambda each: -each.fit)

    def select(self, bridges: Sequence[Bridge], wanted: Collection[Pair]) -> list[Pair]:
        """Select the wanted pairs with most in common, of the bridges that fit best for each cluster."""
        settings = self._team.settings.multimap.selection
        used: dict[int, int] = {}
        chosen: set[Pair] = set()
        for bridge in bridges:
            root = bridge.smaller.root
            pairs = [pair for pair in bridge.pairs if pair in wanted and pair not in chosen]
            if pairs and used.get(root, 0) < settings.bridges:
                chosen.update(pairs[: settings.bridge_pairs])
                used[root] = used.get(root, 0) + 1
        return sorted(chosen)

    def learn(self, clusters: Sequence[Cluster], bridges: Sequence[Bridge]) -> FitOdds:
        """Learn how well right alignments fit, from the answers that joined, and wrong ones, from the first bridges.

        Each answer is taken to put its source on all other maps of its cluster, as if it joined just then. A bridge is
        wrong if its maps have joined otherwise. As long as they have not joined, the best bridges of each cluster are
        left out, because they may be right.
        """
        if not self._first:
            rank: dict[int, int] = {}
            for bridge in bridges:
                rank[bridge.smaller.root] = rank.get(bridge.smaller.root, 0) + 1
                self._first.append((bridge, rank[bridge.smaller.root] <= POSSIBLY_RIGHT))
        cluster_of = {member: cluster for cluster in clusters for member in cluster.poses}
        joined = [_without_source(cluster, edge) for cluster in clusters for edge in cluster.edges]
        wrong = [each.fit for each, possible in self._first if self._is_wrong(each, possible, cluster_of)]
        return FitOdds(self, np.sort([self.measured(each).fit for each in joined]), np.sort(wrong))

    def _is_wrong(self, bridge: Bridge, possible: bool, cluster_of: Mapping[int, Cluster]) -> bool:
        a, b = bridge.between
        if cluster_of[a] is not cluster_of[b]:
            return not possible
        place = bridge.first.poses[a].inverse() @ bridge.first_from_second @ bridge.second.poses[b]
        return self._apart(cluster_of[a].target_from_source(a, b), place, b)

    def measured(self, bridge: Bridge) -> Bridge:
        """Measure an alignment on the pairs of maps that then meet."""
        team, overlap = self._team, self._team.settings.alignment.overlap
        here, there = (self._around(*each) for each in zip((bridge.first, bridge.second), bridge.between, strict=True))
        placed = {b: bridge.first_from_second @ pose for b, pose in there.items()}
        inliers, compared = np.zeros((2, len(overlap.tolerance_shares)))
        pairs: list[tuple[float, Pair]] = []
        for a, b in team.model.neighbours(here, placed):
            between = here[a].inverse() @ placed[b]
            diagonals = team.frames[a].diagonal + between.scale * team.frames[b].diagonal
            if math.hypot(between.x, between.y) > diagonals / 2.0:
                continue
            metric = team.frames[a].metres_from_local @ between @ team.frames[b].metres_from_local.inverse()
            target, source = self._map(a), self._map(b)
            cells = target.metres.inverse() @ metric @ source.metres
            points = team.settings.multimap.selection.coarse_points
            walls = measure_wall_overlap_by_tolerance(target.prepared, source.prepared, cells, points, overlap)
            inliers += [each.inlier_length for each in walls]
            compared += [each.compared_length for each in walls]
            score = mean_score(walls)
            if score > 0.0:
                pairs.append((-score, (min(a, b), max(a, b))))
        fit = float(np.mean((inliers / np.maximum(compared, 1.0)) ** 2))
        return replace(bridge, fit=fit, pairs=tuple(pair for _, pair in sorted(pairs)))

    def _around(self, cluster: Cluster, member: int) -> dict[int, Similarity2]:
        """Return the poses of the maps of a cluster whose middle is within the diagonal of a member of its own."""
        middle, reach = cluster.poses[member], self._team.frames[member].diagonal * cluster.poses[member].scale
        return {
            index: pose
            for index, pose in cluster.poses.items()
            if math.hypot(pose.x - middle.x, pose.y - middle.y) <= reach
        }

    def _map(self, index: int) -> CoarseMap:
        if index not in self._maps:
            self._maps[index] = CoarseMap.of(self._team.maps.grids[index], self._team.settings)
        return self._maps[index]

    def _likeliest(self, clusters: Sequence[Cluster]) -> list[Bridge]:
        """List distinct alignments of clusters, by the best poses of two of their maps."""
        team, poses = self._team, self._poses
        cluster_of = {member: cluster for cluster in clusters for member in cluster.poses}
        left = dict.fromkeys((each.root for each in clusters), team.settings.multimap.selection.bridge_candidates)
        root_of = np.array([cluster_of[k].root for k in range(len(team.maps))])
        across = np.flatnonzero(root_of[poses.targets] != root_of[poses.sources])
        found: dict[Pair, list[Bridge]] = {}
        for k in across[np.argsort(-poses.scores[across], kind="stable")].tolist():
            a, b = int(poses.targets[k]), int(poses.sources[k])
            if root_of[a] > root_of[b]:
                a, b = b, a
            bridge = Bridge(cluster_of[a], cluster_of[b], Similarity2.identity(), (a, b))
            if left[bridge.smaller.root] == 0:
                continue
            (metric,) = poses.target_from_source[np.array([k])].similarities()
            between = team.local(metric, min(a, b), max(a, b))
            between = between if a < b else between.inverse()
            place = bridge.first.poses[a] @ between @ bridge.second.poses[b].inverse()
            others = found.setdefault((bridge.first.root, bridge.second.root), [])
            pose = bridge.second.poses[b]
            if all(self._apart(place @ pose, each.first_from_second @ pose, b) for each in others):
                others.append(replace(bridge, first_from_second=place))
                left[bridge.smaller.root] -= 1
        return [bridge for bridges in found.values() for bridge in bridges]

    def _apart(self, place: Similarity2, other: Similarity2, member: int) -> bool:
        """Test if two transforms put a map at different places."""
        diagonal, moved = self._team.frames[member].diagonal, other.inverse() @ place
        shift = math.hypot(moved.x, moved.y) + abs(moved.yaw) * diagonal / 2.0
        return shift > self._team.settings.multimap.selection.distinct_bridges * diagonal


def _without_source(cluster: Cluster, edge: Edge) -> Bridge:
    """Return the alignment of an answer's source with the rest of its cluster."""
    rest = {index: pose for index, pose in cluster.poses.items() if index != edge.source}
    return _as_bridge(Cluster(rest, ()), Cluster.of_one(edge.source), edge)


def _as_bridge(first: Cluster, second: Cluster, edge: Edge) -> Bridge:
    """Return the alignment of two clusters by one answer, whose target is in the first."""
    place = first.poses[edge.target] @ edge.target_from_source @ second.poses[edge.source].inverse()
    return Bridge(first, second, place, (edge.target, edge.source))


@dataclass(frozen=True, eq=False)
class FitOdds:
    """Log-odds that two clusters are aligned right, from how well all their walls then fit.

    ``right`` and ``wrong`` are fits of right and of wrong alignments, sorted. The odds are the share of right ones that
    fit no better, to that of wrong ones that fit no worse, of which each is counted once more than seen. Beyond the
    right ones seen, their share is that of a log-normal distribution of the misfit with the same quartiles.
    """

    search: BridgeSearch
    right: NDArray[np.float64]
    wrong: NDArray[np.float64]

    def __call__(self, first: Cluster, second: Cluster, alignment: ClusterAlignment) -> float:
        """Judge an alignment by that of its surest answers whose place fits best."""
        surest = sorted(alignment.edges, key=lambda edge: -edge.log_odds)[:MOST_ANSWERS]
        return self.log_odds(max(self.search.measured(_as_bridge(first, second, edge)).fit for edge in surest))

    def log_odds(self, fit: float) -> float:
        """Return the log-odds of a fit, which rise with it; 0 if too few pairs joined to know."""
        if len(self.right) < LEAST_JOINED:
            return 0.0
        seen = (1 + int(np.searchsorted(self.right, fit, side="right"))) / (1 + len(self.right))
        no_worse = 1 + len(self.wrong) - int(np.searchsorted(self.wrong, fit, side="left"))
        return math.log(max(seen, self._tail(fit))) - math.log(no_worse / (1 + len(self.wrong)))

    def _tail(self, fit: float) -> float:
        """Return the share of right alignments that fit no better, by the log-normal distribution of the misfit."""
        low, middle, high = np.log(1.0 - np.quantile(self.right, (0.75, 0.5, 0.25)) + LEAST_MISFIT)
        spread = max((high - low) / QUARTILES, LEAST_SPREAD)
        return float(ndtr((middle - math.log(1.0 - fit + LEAST_MISFIT)) / spread))
