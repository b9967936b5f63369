"""A team being merged: what its pairs say together, and what that says of them again."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from itertools import combinations

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.multimap.cluster import Cluster, agrees, predicted, settled
from merge.multimap.cluster_alignment import ClusterAlignment, ends, joined
from merge.multimap.cluster_merging import LEAST_AGREEING, agreeing_refusals, borne_out, quilt
from merge.multimap.consistency import consistent
from merge.multimap.edge import Edge, LocalFrame
from merge.multimap.guided_matching import (
    NearTask,
    edge,
    match_near,
    not_tried,
    refused,
    won,
)
from merge.multimap.joint_icp import joint
from merge.multimap.overlap_likelihood import OverlapLikelihood
from merge.multimap.pair_selection import Pair
from merge.multimap.pairs import Pairs
from merge.pair.matching import PairTask, match
from merge.records.reason import Reason
from merge.records.result import PairResult

ROUNDS = 2
"""How often pairs are chosen: maps that the first choice did not join are tried with others."""

WORTH = 0.5
"""Log-odds from a glance at the cells from which a pair is judged again where the team puts it."""


class Team(Pairs):
    """The pairs of a team, and the groups that they make."""

    def solve(self) -> list[Cluster]:
        """Match pairs, group the maps, and refine; ``answers`` then has the verdict of each pair."""
        self.match_pairs()
        self.grounds = LocalFrame.all(self.maps, self.shelf)
        self.witness = OverlapLikelihood(self.maps, self.grounds, self.shelf)
        groups = self._groups()
        for _ in range(ROUNDS - 1):
            chosen = self.more_pairs(groups)
            if not chosen:
                break
            self.match(chosen)
            groups = self._groups()
        return self._regained([self._finished(group) for group in groups])

    def edge(self, answer: PairResult) -> Edge:
        indices = self._place_of_name[answer.target], self._place_of_name[answer.source]
        return edge(answer, indices, self.grounds)

    def metric(self, group: Cluster, target: str, source: str) -> Similarity2:
        """target_from_source in stated metres, as a group has it."""
        a, b = self._place_of_name[target], self._place_of_name[source]
        local = predicted(group, a, b)
        return self.grounds[a].metres_from_local @ local @ self.grounds[b].metres_from_local.inverse()

    def _groups(self) -> list[Cluster]:
        edges = [self.edge(self.answers[pair]) for pair in sorted(self.answers) if self.answers[pair].accepted]
        return consistent(len(self.maps), edges, self.witness, self.scale.fixed)

    def _finished(self, group: Cluster) -> Cluster:
        """A group with the pairs that it explains, refined as a whole; the verdicts follow it."""
        if len(group.poses) > 1:
            group = self._explained(group)
            group = joint(group, self.witness.chart, self._tolerances(), self.scale.fixed)
        return group

    def _explained(self, group: Cluster) -> Cluster:
        held = {(e.target, e.source) for e in group.edges}
        open_pairs = [pair for pair in combinations(sorted(group.poses), 2) if pair not in held]
        near = [pair for pair in open_pairs if self.witness(*pair, predicted(group, *pair)) >= WORTH]
        tasks = []
        for pair in near:
            task = self.task(pair)
            tasks.append(NearTask(task, self.metric(group, *task.names)))
        edges = list(group.edges)
        for pair, answer in zip(near, self.run(match_near, tasks), strict=True):
            if answer.accepted and self._as_predicted(answer, group):
                self.answers[pair] = won(self.answers.get(pair), answer, "team")
                edges.append(self.edge(answer))
                held.add(pair)
        for pair in open_pairs:
            if pair not in held:
                self._put_aside(pair, pair in near)
        return (
            settled(Cluster(group.poses, tuple(edges)), edges, self.scale.fixed)
            if len(edges) > len(group.edges)
            else group
        )

    def _regained(self, groups: list[Cluster]) -> list[Cluster]:
        """The groups, those joined that refused answers and all their maps together join."""
        tried: set[tuple[frozenset[int], frozenset[int]]] = set()
        while True:
            for first, second in combinations(sorted(groups, key=lambda group: (-len(group.poses), group.root)), 2):
                key = frozenset(first.poses), frozenset(second.poses)
                if len(first.poses) == 1 or key in tried:
                    continue
                tried.add(key)
                both = self._together(first, second)
                if both is not None:
                    groups = [*(group for group in groups if group not in (first, second)), self._finished(both)]
                    break
            else:
                return sorted(groups, key=lambda group: group.root)

    def _together(self, first: Cluster, second: Cluster) -> Cluster | None:
        """Two groups as one, on refused answers that agree with one another and with their maps matched as one each."""
        answers = [
            self.answers[pair]
            for pair in sorted((min(a, b), max(a, b)) for a in first.poses for b in second.poses)
            if pair in self.answers
        ]
        ways = agreeing_refusals(first, second, answers, self.edge, self.scale.fixed)
        if not ways:
            return None
        there, here = self._quilt(first), self._quilt(second)
        found = self.run(match, [self._quilt_task(there, here)])[0]
        if not found.accepted or found.target_from_source is None:
            return None
        place = first.poses[there[0]] @ self._local(found.target_from_source, there[0], here[0])
        place = place @ second.poses[here[0]].inverse()
        both = Cluster({**first.poses, **{index: place @ pose for index, pose in second.poses.items()}}, ())
        for way in ways:
            pairs = ends(borne_out(way, first, second, place, self.scale.fixed))
            if len(pairs) >= LEAST_AGREEING and self._allowed(both, first, second):
                edges = self._won(both, pairs, found.confidence)
                return joined(first, second, ClusterAlignment(place, edges, 0.0), self.scale.fixed) if edges else None
        return None

    def _won(self, group: Cluster, pairs: Iterable[frozenset[int]], confidence: float) -> tuple[Edge, ...]:
        """Refused pairs, told anew where the group puts them."""
        ordered = sorted((min(pair), max(pair)) for pair in pairs)
        tasks = [NearTask(task, self.metric(group, *task.names)) for task in map(self.task, ordered)]
        edges = []
        for pair, answer in zip(ordered, self.run(match_near, tasks), strict=True):
            if answer.target_from_source is not None and self._as_predicted(answer, group):
                told = dataclasses.replace(answer, accepted=True, refusal=None, confidence=confidence)
                self.answers[pair] = won(self.answers[pair], told, "team")
                edges.append(self.edge(told))
        return tuple(edges)

    def _allowed(self, both: Cluster, first: Cluster, second: Cluster) -> bool:
        """Whether no start pose speaks against two groups lying so."""
        names = self.maps.names
        pairs = ((names[a], names[b]) for a in first.poses for b in second.poses)
        told = ((self.expected[pair], self.metric(both, *pair)) for pair in pairs if pair in self.expected)
        return all(expected.allows(found) for expected, found in told)

    def _quilt(self, group: Cluster) -> tuple[int, OccupancyGrid]:
        """What a group has merged so far, in the frame of its largest map, and which that is."""
        members = sorted(group.poses, key=lambda k: -self.grounds[k].area * group.poses[k].scale ** 2)
        names = [self.maps.names[k] for k in members]
        places = [self.metric(group, names[0], name) for name in names]
        return members[0], quilt(zip(places, (self.maps.grids[k] for k in members), strict=True))

    def _quilt_task(self, target: tuple[int, OccupancyGrid], source: tuple[int, OccupancyGrid]) -> PairTask:
        units = self.maps.units[target[0]], self.maps.units[source[0]]
        grids = target[1], source[1]
        return PairTask(("merged", "merged"), grids, units, self.scale, self.settings, self.seed)

    def _local(self, metric: Similarity2, target: int, source: int) -> Similarity2:
        """target_from_source in local frames, from that in metres."""
        return self.grounds[target].metres_from_local.inverse() @ metric @ self.grounds[source].metres_from_local

    def _as_predicted(self, answer: PairResult, group: Cluster) -> bool:
        found = self.edge(answer)
        return agrees(found, predicted(group, found.target, found.source), self.scale.fixed, found.covariance)

    def _put_aside(self, pair: Pair, near: bool) -> None:
        answer = self.answers.get(pair)
        if answer is None:
            self.answers[pair] = not_tried(
                self.task(pair), Reason.NOT_SELECTED if near else Reason.NO_PREDICTED_OVERLAP
            )
        elif answer.accepted:
            self.answers[pair] = refused(answer, Reason.CONTRADICTS_TEAM, "team")

    def _tolerances(self) -> dict[Pair, float]:
        return {
            pair: answer.evidence.tolerance_cells
            for pair, answer in self.answers.items()
            if answer.evidence is not None and answer.accepted
        }

    def verdicts(self, groups: Sequence[Cluster]) -> list[PairResult]:
        """What became of each pair, in the order in which the maps came."""
        group_of = {index: k for k, group in enumerate(groups) for index in group.poses}
        for pair in self.pairs():
            answer = self.answers.get(pair)
            if answer is None:
                self.answers[pair] = not_tried(self.task(pair), Reason.NOT_SELECTED)
            elif answer.accepted and group_of[pair[0]] != group_of[pair[1]]:
                self.answers[pair] = refused(answer, Reason.CONTRADICTS_TEAM, "team")
        in_order = sorted(self.answers, key=lambda pair: tuple(map(self.names.index, self.task(pair).names)))
        return [self.answers[pair] for pair in in_order]
