"""Bridges: alignments by which two clusters of a large team may join.

A map looks like many places of a large building. Two clusters, laid over one another as one of those says, meet in many
maps, and only in the right place do the walls of all of them fit as well as they fit inside the clusters. How well that
is, is learned from the team itself: from the pairs that joined, and from places that look alike inside the clusters.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, log_ndtr

from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array
from merge.alignment.correspondences import add_equations, add_equations_back
from merge.multimap.graph import Cluster, ClusterAlignment, Edge, Pair, placed_together
from merge.multimap.overlap_likelihood import prepared_from_local
from merge.multimap.pose_graph import join_clusters
from merge.multimap.team import Answers, Team
from merge.preparation.surface import thinned
from merge.retrieval.relative_poses import RelativePoses
from merge.verification.wall_overlap import measure_wall_overlap_by_tolerance

LEAST_MISFIT = 0.002
"""Misfits far below this are noise."""

USUAL_LENGTH = 300.0
"""A map is taken to have so much wall that fits as the walls of all maps do, beside what it has [wide cells]."""

LEAST_SPREAD = 0.5
"""Least standard deviation of the logarithm of the misfit: pairs that joined hold their maps where they fit best."""

QUARTILES = 1.349
"""Distance of the quartiles of a normal distribution [standard deviations]."""

LEAST_JOINED = 20
"""Pairs that must have joined before their misfits say how well right alignments fit."""

LEAST_TAIL = 5
"""Values in the lowest tenth of a sample from which on a tail is fitted to them."""

SAMPLE = 300
"""Right and wrong alignments whose misfits are measured."""

LEAST_PROBABILITY = 0.5
"""Clusters are joined by an alignment of at least this probability."""

MEASURED_ON, REFINED_ON = 30, 12
"""Pairs of maps that meet on which an alignment is measured and refined."""

HOPELESS, GIVEN_UP = 20.0, 25.0
"""An alignment of such a misfit is not refined, and not even measured on all maps that meet."""

UNSEEN = 2.0
"""So much wall more than seen is taken to be off, so that a short comparison is not sure [wide cells]."""

LEAST_GAIN = 0.1
"""An alignment is refined again if its misfit fell by this share."""

STEPS = 8
"""Steps by which an alignment is refined."""

GATES = 0.08, 0.012
"""Largest distance of walls that are paired in the first and in the last of them [of the smaller map's diagonal]."""

THOROUGH = 4
"""A thorough search measures so many times the usual number of alignments."""

SLIDES = (-0.06, -0.04, -0.02, 0.02, 0.04, 0.06)
"""Steps by which an alignment that may slide is tried [of a map's diagonal]."""

HELD_STEPS, HELD_MISFIT = (-0.04, -0.02, 0.02, 0.04), 3.0
"""An alignment is held if it fits so many times worse when it is moved by these steps [of a map's diagonal]."""

Meeting = tuple[int, int, Similarity2]
"""A map of the first and one of the second cluster that meet, and the pose of the one from the other."""


@dataclass(frozen=True, eq=False)
class Bridge:
    """An alignment of two clusters.

    It places the maps ``between`` on one another, one of either. ``misfit`` is that of all walls that then meet around
    them: the share of the ``length`` [wide cells] compared that is off the walls of the other cluster, divided by the
    share that is usual for these maps. Further away the errors of whole clusters add up. ``pairs`` are the maps that
    meet, those with most in common first.
    """

    first: Cluster
    second: Cluster
    first_from_second: Similarity2
    between: Pair
    misfit: float = math.inf
    length: float = 0.0
    pairs: tuple[Pair, ...] = ()

    @property
    def smaller(self) -> Cluster:
        """The cluster of fewer maps; of two of one size that with the larger root."""
        return min(self.first, self.second, key=lambda each: (len(each.poses), -each.root))

    @property
    def placed(self) -> Cluster:
        """The poses of all maps under the alignment, in the frame of the first cluster, without edges."""
        return placed_together(self.first, self.second, self.first_from_second)

    def target_from_source(self, a: int, b: int) -> Similarity2:
        """Return the relative pose of a map of the first cluster and one of the second."""
        return self.first.poses[a].inverse() @ self.first_from_second @ self.second.poses[b]


class BridgeSearch:
    """Find and measure alignments of clusters, from the relative ``poses`` that the index suggests."""

    def __init__(self, team: Team, poses: RelativePoses) -> None:
        self._team, self._poses = team, poses
        self._usual = np.full(len(team.maps), LEAST_MISFIT)
        self._usual_of_all = LEAST_MISFIT

    def find(self, clusters: Sequence[Cluster], answers: Answers, thorough: bool = False) -> list[Bridge]:
        """List the likeliest distinct alignments of each cluster with larger ones, those that fit best first.

        They are suggested by the index, or by answers of pairs, which may have been refused. A ``thorough`` search
        takes more of them, and tries each also at places along the direction that walls hold least, as in a corridor.
        """
        self._measure_usual(clusters)
        poses = RelativePoses.joined([self._poses, _poses_of(self._team, answers)])
        fit, times = (self._slid, THOROUGH) if thorough else (self.fitted, 1)
        return sorted(map(fit, self._likeliest(clusters, poses, times)), key=lambda each: each.misfit)

    def fitted(self, bridge: Bridge) -> Bridge:
        """Refine an alignment as long as it fits better, and measure it; one that is hopeless is not refined."""
        best = self.measured(bridge)
        while best.misfit <= HOPELESS:
            refined = self.measured(self.refined(best))
            if refined.misfit > (1.0 - LEAST_GAIN) * best.misfit:
                return min(best, refined, key=lambda each: each.misfit)
            best = refined
        return best

    def _slid(self, bridge: Bridge) -> Bridge:
        """Fit an alignment, and also from places along the direction in which it slides; return the best."""
        best = self.fitted(bridge)
        if best.misfit > HOPELESS:
            return best
        return min((best, *map(self.fitted, self._along(best, SLIDES))), key=lambda each: each.misfit)

    def holds(self, bridge: Bridge) -> bool:
        """Test if the walls that meet hold an alignment in every direction; those of a bare corridor do not."""
        moved = (self.measured(each) for each in self._along(bridge, HELD_STEPS))
        return all(each.misfit > HELD_MISFIT * bridge.misfit for each in moved)

    def is_at(self, bridge: Bridge, edge: Edge) -> bool:
        """Test if an edge puts its source where a bridge does, far nearer than the steps by which that is held."""
        moved = bridge.placed.target_from_source(edge.target, edge.source).inverse() @ edge.target_from_source
        nearest = min(map(abs, HELD_STEPS)) / 2.0 * self._team.frames[edge.source].diagonal
        return math.hypot(moved.x, moved.y) < nearest

    def _along(self, bridge: Bridge, steps: Sequence[float]) -> list[Bridge]:
        """Move an alignment along the direction in which its walls hold it least, by shares of a map's diagonal."""
        weakest = np.linalg.eigh(self._equations(bridge, GATES[-1])[:2, :2])[1][:, 0]
        anchor, diagonal = bridge.first.poses[bridge.between[0]], self._team.frames[bridge.between[0]].diagonal
        moves = (anchor @ Similarity2(*(step * diagonal * weakest).tolist()) @ anchor.inverse() for step in steps)
        return [replace(bridge, first_from_second=move @ bridge.first_from_second) for move in moves]

    def learn(self, clusters: Sequence[Cluster]) -> MisfitOdds:
        """Learn how well right alignments fit, from the pairs that joined, and wrong ones, from poses inside clusters.

        Each pair that joined is taken to put its source on all other maps of its cluster, as if it joined just then. So
        is each of the best poses that the index suggests and the cluster contradicts. An alignment has to compare as
        much wall as half of the pairs do that joined.
        """
        cluster_of = {member: cluster for cluster in clusters for member in cluster.poses}
        joined = [_without_source(each, edge.target, edge.source) for each in clusters for edge in each.edges]
        joined, contradicted = (
            bridges[:: max(1, math.ceil(len(bridges) / SAMPLE))] for bridges in (joined, self._contradicted(cluster_of))
        )
        pairs = [self._compared(*each.between, each.target_from_source(*each.between))[1] for each in joined]
        return MisfitOdds(
            np.array([self.fitted(each).misfit for each in joined]),
            np.array([self.fitted(each).misfit for each in contradicted]),
            float(np.median(pairs)) if pairs else 0.0,
            -math.log(self._team.settings.multimap.selection.bridge_candidates),
        )

    def _contradicted(self, cluster_of: Mapping[int, Cluster]) -> list[Bridge]:
        """List alignments of maps with the rest of their clusters by the best poses that those contradict."""
        poses, most = self._poses, self._team.settings.multimap.selection.member_candidates
        listed: dict[int, int] = {}
        found = []
        for k in np.argsort(-poses.scores, kind="stable").tolist():
            a, b = int(poses.targets[k]), int(poses.sources[k])
            cluster = cluster_of[a]
            if cluster is not cluster_of[b] or listed.get(b, 0) == most:
                continue
            bridge = _without_source(cluster, a, b)
            place = cluster.poses[a] @ _local(self._team, poses, k)
            if self._apart(place, bridge.first_from_second, b):
                listed[b] = listed.get(b, 0) + 1
                found.append(replace(bridge, first_from_second=place))
        return found

    def refined(self, bridge: Bridge) -> Bridge:
        """Move one cluster as a whole until the walls that meet fit best: ICP (Besl and McKay 1992) on all of them."""
        anchor, meeting = bridge.first.poses[bridge.between[0]], self._meeting(bridge)[:REFINED_ON]
        for gate in np.geomspace(*GATES, STEPS).tolist():
            equations = self._equations(bridge, gate, meeting)
            hessian = equations[:, :3] + 1e-9 * np.trace(equations[:, :3]) * np.eye(3)
            if not hessian[0, 0] > 0.0:
                return bridge
            move = Similarity2(*np.linalg.solve(hessian, equations[:, 3]).tolist())
            bridge = replace(bridge, first_from_second=anchor @ move @ anchor.inverse() @ bridge.first_from_second)
        return bridge

    def _equations(self, bridge: Bridge, gate: float, meeting: Sequence[Meeting] | None = None) -> NDArray[np.float64]:
        """Sum the normal equations (3, 4) of all maps that meet, by x, y [wide cells] and yaw [rad] of a move.

        The move is that of the second cluster, in the frame of the first map ``between``.
        """
        meeting = self._meeting(bridge)[:REFINED_ON] if meeting is None else meeting
        return sum((self._equations_of(bridge, a, b, gate) for a, b, _ in meeting), np.zeros((3, 4)))

    def _equations_of(self, bridge: Bridge, a: int, b: int, gate: float) -> NDArray[np.float64]:
        """Return those (3, 4) of the walls of two maps that are nearer than the gate [of the smaller diagonal]."""
        settings, target, source = self._team.settings, *map(self._team.likelihood.prepared, (a, b))
        pose = prepared_from_local(target, source, bridge.target_from_source(a, b))
        near = gate * min(target.diagonal, pose.scale * source.diagonal)
        points, line_weight = settings.multimap.selection.coarse_points // 2, settings.alignment.icp.line_weight
        (here, weight), (back, back_weight) = (thinned(len(each.points), points) for each in (source, target))
        surfaces, matrix, centre = (target.surface, source.surface), pose.matrix(), pose.apply(source.middle)
        found = np.zeros((4, 5))
        add_equations(*surfaces, here, weight * pose.scale, matrix, near, line_weight, centre, found)
        inverse = pose.inverse().matrix()
        add_equations_back(*surfaces, back, back_weight, matrix, inverse, near / pose.scale, line_weight, centre, found)
        cells_from_anchor = Similarity2(*target.middle.tolist()) @ bridge.first.poses[a].inverse()
        cells_from_anchor = cells_from_anchor @ bridge.first.poses[bridge.between[0]]
        moves = (Similarity2(*centre.tolist()).inverse() @ cells_from_anchor).adjoint()[:, :3]
        return np.asarray(moves.T @ np.column_stack((found[:, :4] @ moves, found[:, 4])))

    def measured(self, bridge: Bridge) -> Bridge:
        """Measure an alignment on the maps that then meet."""
        off, expected, length = 0.0, 0.0, 0.0
        pairs: list[tuple[float, Pair]] = []
        for a, b, between in self._meeting(bridge):
            inliers, compared = self._compared(a, b, between)
            if compared == 0.0:
                continue
            usual = max(self._usual[a] + self._usual[b] - self._usual_of_all, self._usual_of_all / 4.0)
            off, expected, length = off + compared - inliers, expected + usual * compared, length + compared
            if off > GIVEN_UP * (expected + LEAST_MISFIT * length) and length > USUAL_LENGTH:
                break
            if inliers > 0.0:
                pairs.append((-inliers, (min(a, b), max(a, b))))
        noise = LEAST_MISFIT * length
        misfit = (off + noise + UNSEEN) / (expected + noise) if length > 0.0 else math.inf
        return replace(bridge, misfit=misfit, length=length, pairs=tuple(pair for _, pair in sorted(pairs)))

    def _measure_usual(self, clusters: Iterable[Cluster]) -> None:
        """Measure what share of the walls of each map is off the walls of its own cluster."""
        off, length = np.zeros((2, len(self._team.maps)))
        for cluster in clusters:
            for a, b, between in self._near(cluster.poses, cluster.poses):
                if a < b:
                    inliers, compared = self._compared(a, b, between)
                    off[[a, b]] += compared - inliers
                    length[[a, b]] += compared
        self._usual_of_all = max(float(off.sum() / max(length.sum(), 1.0)), LEAST_MISFIT)
        self._usual = (off + USUAL_LENGTH * self._usual_of_all) / (length + USUAL_LENGTH)

    def _compared(self, a: int, b: int, between: Similarity2) -> tuple[float, float]:
        """Return the length of the walls of two maps that match by the tightest tolerance, and that is compared.

        Both are 0 for maps that only touch: of their last cells as many are off as not.
        """
        team, maps = self._team, (self._team.likelihood.prepared(a), self._team.likelihood.prepared(b))
        points, overlap = team.settings.multimap.selection.coarse_points, team.settings.alignment.overlap
        walls = measure_wall_overlap_by_tolerance(*maps, prepared_from_local(*maps, between), points, overlap)[-1]
        if walls.compared_length < team.settings.multimap.likelihood.min_compared_cells:
            return 0.0, 0.0
        return walls.inlier_length, walls.compared_length

    def _meeting(self, bridge: Bridge) -> list[Meeting]:
        """List maps that meet around those between, one of the first and one of the second cluster, and poses.

        Those with the nearest middles come first, and are enough.
        """
        here, there = (self._around(*each) for each in zip((bridge.first, bridge.second), bridge.between, strict=True))
        return self._near(here, {b: bridge.first_from_second @ pose for b, pose in there.items()})[:MEASURED_ON]

    def _near(self, here: Mapping[int, Similarity2], there: Mapping[int, Similarity2]) -> list[Meeting]:
        """List the maps of which one's middle lies about within the other, the nearest first, and relative poses."""
        found: list[tuple[float, int, int, Similarity2]] = []
        frames = self._team.frames
        for a, b in self._team.model.neighbours(here, there):
            between = here[a].inverse() @ there[b]
            diagonals = frames[a].diagonal + between.scale * frames[b].diagonal
            apart = 2.0 * math.hypot(between.x, between.y) / diagonals
            if a != b and apart <= 1.0:
                found.append((apart, a, b, between))
        return [(a, b, between) for _, a, b, between in sorted(found, key=lambda each: each[:3])]

    def _around(self, cluster: Cluster, member: int) -> dict[int, Similarity2]:
        """Return the poses of the maps of a cluster whose middle is within the diagonal of a member of its own."""
        middle, reach = cluster.poses[member], self._team.frames[member].diagonal * cluster.poses[member].scale
        return {
            index: pose
            for index, pose in cluster.poses.items()
            if math.hypot(pose.x - middle.x, pose.y - middle.y) <= reach
        }

    def _likeliest(self, clusters: Sequence[Cluster], poses: RelativePoses, times: int) -> list[Bridge]:
        """List distinct alignments of clusters, by the best poses of two of their maps, ``times`` the usual number."""
        team, settings = self._team, self._team.settings.multimap.selection
        cluster_of = {member: cluster for cluster in clusters for member in cluster.poses}
        left = {
            each.root: times * max(settings.bridge_candidates, settings.member_candidates * len(each.poses))
            for each in clusters
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
            if all(self._apart(place @ pose, each.first_from_second @ pose, b) for each in others):
                others.append(replace(bridge, first_from_second=place))
                left[bridge.smaller.root] -= 1
        return [bridge for bridges in found.values() for bridge in bridges]

    def _apart(self, place: Similarity2, other: Similarity2, member: int) -> bool:
        """Test if two transforms put a map at different places."""
        diagonal, moved = self._team.frames[member].diagonal, other.inverse() @ place
        shift = math.hypot(moved.x, moved.y) + abs(moved.yaw) * diagonal / 2.0
        return shift > self._team.settings.multimap.selection.distinct_bridges * diagonal


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


def _without_source(cluster: Cluster, target: int, source: int) -> Bridge:
    """Return the alignment of a map with the rest of its cluster, as the cluster has it."""
    rest = Cluster({index: pose for index, pose in cluster.poses.items() if index != source}, ())
    return Bridge(rest, Cluster.of_one(source), cluster.poses[source], (target, source))


def bridge_of_edge(first: Cluster, second: Cluster, edge: Edge) -> Bridge:
    """Return the alignment of two clusters by one answer, whose target is in the first."""
    place = first.poses[edge.target] @ edge.target_from_source @ second.poses[edge.source].inverse()
    return Bridge(first, second, place, (edge.target, edge.source))


@dataclass(frozen=True, eq=False)
class MisfitOdds:
    """Probability that two clusters are aligned right, from how well all their walls then fit.

    ``right`` (R,) are misfits of right alignments, ``wrong`` (W,) of wrong ones, and ``prior`` the log-odds of an
    alignment before. They change by the share of right ones that fit no better, divided by that of wrong ones that fit
    no worse. The former is that of a log-normal distribution with the same quartiles, the latter that of a Pareto
    distribution fitted to the tenth that fits best (Hill 1975). Where little is compared wrong ones fit well more
    often; so no alignment is likely that compares less than ``least_length`` [wide cells].
    """

    right: NDArray[np.float64]
    wrong: NDArray[np.float64]
    least_length: float
    prior: float

    def probability(self, bridge: Bridge) -> float:
        """Return the probability that an alignment is right; it falls with the misfit."""
        return float(expit(self.log_odds(bridge)))

    def likely(self, bridges: Iterable[Bridge]) -> list[tuple[Bridge, float]]:
        """List those that are probably right, the most probable first, with their probability."""
        found = [(bridge, self.probability(bridge)) for bridge in bridges]
        return sorted((each for each in found if each[1] > LEAST_PROBABILITY), key=lambda each: -each[1])

    def log_odds(self, bridge: Bridge) -> float:
        """Return the log-odds of an alignment; none is likely that compares little, or if too few pairs joined."""
        if len(self.right) < LEAST_JOINED or bridge.length < self.least_length or not bridge.misfit < math.inf:
            return -math.inf
        low, middle, high = np.log(np.quantile(self.right, (0.25, 0.5, 0.75)))
        spread = max((high - low) / QUARTILES, LEAST_SPREAD)
        no_better = float(log_ndtr((middle - math.log(bridge.misfit)) / spread))
        return self.prior + no_better - _log_share_below(self.wrong, bridge.misfit)


def _log_share_below(sample: NDArray[np.float64], value: float) -> float:
    """Return the logarithm of the share of a sample up to a value; in its lowest tenth that of a Pareto tail.

    The exponent is one standard error less than estimated, and the share no less than a tenth of a value. A sample too
    small for a tail has one value more than seen.
    """
    sample, tail = np.sort(sample), len(sample) // 10
    if tail < LEAST_TAIL or value >= sample[tail]:
        return math.log((1 + int(np.searchsorted(sample, value, side="right"))) / (1 + len(sample)))
    steepness = 1.0 / max(float(np.mean(np.log(sample[tail] / sample[:tail]))), 1e-3)
    steepness *= 1.0 - 1.0 / math.sqrt(tail)
    share = (1 + tail) * (value / float(sample[tail])) ** steepness
    return math.log(max(share, 0.1) / (1 + len(sample)))


def join_bridges(
    team: Team, search: BridgeSearch, odds: MisfitOdds, clusters: Sequence[Cluster], edges: Sequence[Edge]
) -> list[Cluster]:
    """Join clusters by edges between them, in their order, as far as all walls then fit."""
    cluster_of = {member: cluster for cluster in clusters for member in cluster.poses}
    for edge in edges:
        first, second = cluster_of[edge.target], cluster_of[edge.source]
        if first is second:
            continue
        bridge = search.fitted(bridge_of_edge(first, second, edge))
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


def _joins(edge: Edge, first: Cluster, second: Cluster) -> bool:
    return edge.target in first.poses and edge.source in second.poses
