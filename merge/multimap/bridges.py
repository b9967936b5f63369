"""Bridges between the clusters of a large team: find likely ones, learn which are right, and join the clusters.

A map looks like many places of a large building. Two clusters, laid over one another as one of those says, meet in many
maps, and only in the right place do the walls of all of them fit as well as they fit inside the clusters. How well that
is, is learned from the team itself: from the pairs that joined, and from places that look alike inside the clusters.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array
from merge.multimap.bridge import Bridge
from merge.multimap.bridge_fit import BridgeFit
from merge.multimap.graph import Cluster, ClusterAlignment, Edge, Pair
from merge.multimap.misfit_odds import LEAST_PROBABILITY, MisfitOdds
from merge.multimap.pose_graph import join_clusters
from merge.multimap.team import Answers, Team
from merge.retrieval.relative_poses import RelativePoses

SAMPLE = 300
"""Right and wrong alignments whose misfits are measured."""

PLAUSIBLE = math.log(0.01)
"""Least log-odds of an alignment that counts as an alternative."""

THOROUGH = 4
"""A thorough search measures so many times the usual number of alignments."""


class BridgeSearch:
    """Find alignments of the clusters of a team, and learn which are right, from ``poses`` that the index suggests.

    ``fit`` measures them.
    """

    def __init__(self, team: Team, poses: RelativePoses, clusters: Sequence[Cluster]) -> None:
        self._team, self._poses, self._clusters = team, poses, clusters
        self.fit = BridgeFit(team, clusters)

    def find(self, answers: Answers, thorough: bool = False) -> list[Bridge]:
        """List the likeliest distinct alignments of each cluster with larger ones, those that fit best first.

        They are suggested by the index, or by answers of pairs, which may have been refused. A ``thorough`` search
        takes more of them, and tries each also at places along the direction that walls hold least, as in a corridor.
        """
        poses = RelativePoses.joined([self._poses, _poses_of(self._team, answers)])
        fitted, times = (self.fit.slid, THOROUGH) if thorough else (self.fit.fitted, 1)
        return sorted(map(fitted, self._likeliest(poses, times)), key=lambda each: each.misfit)

    def likely(self, odds: MisfitOdds, bridges: Sequence[Bridge]) -> list[tuple[Bridge, float]]:
        """List the alignments that are probably right, the most probable first, with their probability.

        Alignments of a cluster that contradict one another share the probability, since at most one of them is right:
        they put it to two places of one cluster, or on two clusters that then do not fit one another.
        """
        plausible: dict[int, list[tuple[Bridge, float]]] = {}
        for bridge in bridges:
            log_odds = odds.log_odds(bridge)
            if log_odds > PLAUSIBLE:
                plausible.setdefault(bridge.smaller.root, []).append((bridge.larger_first, math.exp(log_odds)))
        found: list[tuple[Bridge, float]] = []
        for alternatives in plausible.values():
            sums = [1.0 + weight for _, weight in alternatives]
            for i, k in combinations(range(len(alternatives)), 2):
                (one, weight), (other, other_weight) = alternatives[i], alternatives[k]
                if self._contradict(one, other, odds):
                    sums[i] += other_weight
                    sums[k] += weight
            found += [(each, weight / total) for (each, weight), total in zip(alternatives, sums, strict=True)]
        return sorted((each for each in found if each[1] > LEAST_PROBABILITY), key=lambda each: -each[1])

    def _contradict(self, one: Bridge, other: Bridge, odds: MisfitOdds) -> bool:
        """Test if two alignments of one cluster, their second, cannot both be right: the walls speak against it."""
        if one.first is other.first:
            pose = one.second.poses[one.between[1]]
            places = Similarity2Array.of([other.first_from_second @ pose])
            return self._apart(one.first_from_second @ pose, places, one.between[1])
        place = one.first_from_second @ other.first_from_second.inverse()
        both = self.fit.fitted(Bridge(one.first, other.first, place, (one.between[0], other.between[0])))
        return both.misfit < math.inf and odds.log_odds_of(both.misfit) < odds.prior

    def learn(self) -> MisfitOdds:
        """Learn how well right alignments fit, from the pairs that joined, and wrong ones, from poses inside clusters.

        Each pair that joined is taken to put its source on all other maps of its cluster, as if it joined just then. So
        is each of the best poses that the index suggests and the cluster contradicts. An alignment has to compare as
        much wall as half of the pairs do that joined.
        """
        joined = [Bridge.inside(each, edge.target, edge.source) for each in self._clusters for edge in each.edges]
        joined, contradicted = (
            bridges[:: max(1, math.ceil(len(bridges) / SAMPLE))] for bridges in (joined, self._contradicted())
        )
        pairs = [self.fit.compared(*each.between, each.target_from_source(*each.between))[1] for each in joined]
        return MisfitOdds(
            np.array([self.fit.fitted(each).misfit for each in joined]),
            np.array([self.fit.fitted(each).misfit for each in contradicted]),
            float(np.median(pairs)) if pairs else 0.0,
            -math.log(self._team.settings.multimap.selection.bridge_candidates),
        )

    def _contradicted(self) -> list[Bridge]:
        """List alignments of maps with the rest of their clusters by the best poses that those contradict."""
        poses, most = self._poses, self._team.settings.multimap.selection.member_candidates
        cluster_of = _cluster_of(self._clusters)
        listed: dict[int, int] = {}
        found = []
        for k in np.argsort(-poses.scores, kind="stable").tolist():
            a, b = int(poses.targets[k]), int(poses.sources[k])
            cluster = cluster_of[a]
            if cluster is not cluster_of[b] or listed.get(b, 0) == most:
                continue
            bridge = Bridge.inside(cluster, a, b)
            place = cluster.poses[a] @ _local(self._team, poses, k)
            if self._apart(place, Similarity2Array.of([bridge.first_from_second]), b):
                listed[b] = listed.get(b, 0) + 1
                found.append(replace(bridge, first_from_second=place))
        return found

    def _likeliest(self, poses: RelativePoses, times: int) -> list[Bridge]:
        """List distinct alignments of clusters, by the best poses of two of their maps, ``times`` the usual number."""
        team, settings = self._team, self._team.settings.multimap.selection
        cluster_of = _cluster_of(self._clusters)
        left = {
            each.root: times * max(settings.bridge_candidates, settings.member_candidates * len(each.poses))
            for each in self._clusters
        }
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
            between = _local(team, poses, k) if a < b else _local(team, poses, k).inverse()
            place = bridge.first.poses[a] @ between @ bridge.second.poses[b].inverse()
            others = found.setdefault((bridge.first.root, bridge.second.root), [])
            pose = bridge.second.poses[b]
            placed = Similarity2Array.of(each.first_from_second for each in others) @ Similarity2Array.of([pose])
            if self._apart(place @ pose, placed, b):
                others.append(replace(bridge, first_from_second=place))
                left[bridge.smaller.root] -= 1
        return [bridge for bridges in found.values() for bridge in bridges]

    def _apart(self, place: Similarity2, others: Similarity2Array, member: int) -> bool:
        """Test if a transform puts a map at another place than all ``others`` (N,)."""
        diagonal, moved = self._team.frames[member].diagonal, others.inverse() @ Similarity2Array.of([place])
        shift = np.abs(moved.shift) + np.abs(np.angle(moved.turn)) * diagonal / 2.0
        return bool(np.all(shift > self._team.settings.multimap.selection.distinct_bridges * diagonal))


def _poses_of(team: Team, answers: Answers) -> RelativePoses:
    """Return the transforms of pairs, with their alignment scores."""
    pairs, poses, scores = [], [], []
    for pair, answer in answers.items():
        if answer.target_from_source is not None and answer.evidence is not None:
            in_order = (team.index(answer.target), team.index(answer.source)) == pair
            pairs.append(pair)
            poses.append(answer.target_from_source if in_order else answer.target_from_source.inverse())
            scores.append(answer.evidence.score)
    lower, higher = np.array(pairs, np.intp).reshape(-1, 2).T
    return RelativePoses(lower, higher, Similarity2Array.of(poses), np.array(scores, np.float64))


def _local(team: Team, poses: RelativePoses, k: int) -> Similarity2:
    """Return one of the poses, target from source, between local frames."""
    (metric,) = poses.target_from_source[np.array([k])].similarities()
    return team.local(metric, int(poses.targets[k]), int(poses.sources[k]))


def join_bridges(
    team: Team, fit: BridgeFit, odds: MisfitOdds, clusters: Sequence[Cluster], edges: Sequence[Edge]
) -> list[Cluster]:
    """Join clusters by edges between them, in their order, as far as all walls then fit."""
    cluster_of = _cluster_of(clusters)
    for edge in edges:
        first, second = cluster_of[edge.target], cluster_of[edge.source]
        if first is second:
            continue
        bridge = fit.fitted(Bridge.of_edge(first, second, edge))
        if odds.probability(bridge) <= LEAST_PROBABILITY or not team.priors_allow(
            first, second, bridge.first_from_second
        ):
            continue
        across = [each for other in edges for each in (other, other.reversed()) if _joins(each, first, second)]
        agreeing = tuple(
            each
            for each in across
            if team.model.agrees(each, bridge.target_from_source(each.target, each.source), each.covariance)
        )
        if agreeing:
            alignment = ClusterAlignment(bridge.first_from_second, agreeing, 0.0)
            joined = join_clusters(first, second, alignment, team.model)
            cluster_of.update(dict.fromkeys(joined.poses, joined))
    return sorted(set(cluster_of.values()), key=lambda each: each.root)


def _cluster_of(clusters: Sequence[Cluster]) -> dict[int, Cluster]:
    return {member: cluster for cluster in clusters for member in cluster.poses}


def _joins(edge: Edge, first: Cluster, second: Cluster) -> bool:
    return edge.target in first.poses and edge.source in second.poses
