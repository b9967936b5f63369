"""From answers for pairs to groups of maps whose answers agree with one another; wrong answers are left aside.

Sets of mutually consistent answers are what PCM (Mangelson et al. 2018) and CLIPPER (Lusk et al. 2021) look for between
two robots; among whole maps consistency is that of cycles, so groups grow by the transform that most answers between
two of them agree on (as in the sampled graphs of Jiang et al. 2019, but without sampling), and the cells of all maps
that would come to lie on one another are heard before two groups are joined.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree, shortest_path
from scipy.special import chdtri, expit

from mapping.similarity2 import Similarity2
from merge.edge import Edge, about, difference
from merge.pose_graph import averaged

Place = Callable[[int, int, Similarity2], float]
"""The log-odds, from the cells, that the source lies at a place on the target (:class:`merge.witness.Witness`)."""

QUANTILE = 0.999
"""Of right answers so many pass as agreeing with one another."""

IN_TRIANGLE, AGAINST_TRIANGLE = 2.0, -2.0
"""Log-odds that an answer gains in a triangle of answers that agree, and loses in one that does not, where the two
others are right (after Zach et al. 2010)."""

TURNS = 6

SUREST, UNSUREST = 8.0, -4.0

MOST_HEARD, MOST_TRIED = 8, 3
"""Of a part so many places are heard; of all parts so many shifts are tried."""

WORST_GAIN = -3.0
"""What a shift may lose at first sight: one noisy answer puts a part less well than all do that then agree."""

LEAST_GAIN = 0.25
"""A part is only shifted for so much more."""

BEST_HEARD = 12.0
"""The cells say no more than this for a place that few answers speak for."""


@dataclass(frozen=True, eq=False)
class Group:
    """Maps that are joined: ``poses`` are root_from_map between local frames, ``edges`` those that agree with them."""

    poses: Mapping[int, Similarity2]
    edges: tuple[Edge, ...]

    @property
    def root(self) -> int:
        return min(self.poses)


@dataclass(frozen=True, eq=False)
class _Join:
    """How two groups may be joined, and the edges that say so."""

    first_from_second: Similarity2
    edges: tuple[Edge, ...]
    support: float


def consistent(maps: int, edges: Sequence[Edge], place: Place, fixed_scale: bool) -> list[Group]:
    """Groups of the maps 0 to ``maps`` - 1, in the order of their lowest members, each with the edges that hold."""
    plain = edges
    edges = _weighted(edges, place, fixed_scale)
    groups: dict[int, Group] = {index: Group({index: Similarity2.identity()}, ()) for index in range(maps)}
    joins: dict[tuple[int, int], list[_Join]] = {}
    for pair in combinations(sorted(groups), 2):
        joins[pair] = _joins(groups[pair[0]], groups[pair[1]], edges, fixed_scale)
    while True:
        options = [(-waiting[0].support, pair) for pair, waiting in joins.items() if waiting]
        if not options:
            break
        first, second = min(options)[1]
        join = joins[first, second].pop(0)
        told = _spoken(join, plain) + _heard(groups[first], groups[second], join, place, _ends(join.edges))
        if told <= 0.0:
            continue
        groups[first] = _joined(groups[first], groups.pop(second), join, edges, fixed_scale)
        joins = {pair: waiting for pair, waiting in joins.items() if not {first, second} & set(pair)}
        for other in groups:
            if other != first:
                pair = min(first, other), max(first, other)
                joins[pair] = _joins(groups[pair[0]], groups[pair[1]], edges, fixed_scale)
    return [_mended(groups[index], plain, place, fixed_scale) for index in sorted(groups)]


def agrees(edge: Edge, predicted: Similarity2, fixed_scale: bool, slack: NDArray[np.float64] | None = None) -> bool:
    """Whether an answer and what others predict for its pair may both be right, ``slack`` (4, 4) being how far off the
    prediction may be: a chi-square test."""
    unknowns = 3 if fixed_scale else 4
    covariance = edge.covariance if slack is None else edge.covariance + slack
    off = difference(predicted, edge.target_from_source)[:unknowns]
    square = float(off @ np.linalg.solve(covariance[:unknowns, :unknowns], off))
    return square < float(_GATES[unknowns])


_GATES = {unknowns: float(chdtri(unknowns, 1.0 - QUANTILE)) for unknowns in (3, 4)}


def _weighted(edges: Sequence[Edge], place: Place, fixed_scale: bool) -> list[Edge]:
    """The edges, by whose weights groups are joined: their own cells, and the triangles that they are in, are heard.

    A triangle says as much of an edge as its two others are believed, which is found by turns.
    """
    between = {(e.target, e.source): (k, e) for k, edge in enumerate(edges) for e in (edge, edge.reversed())}
    beside: dict[int, set[int]] = {}
    for target, source in between:
        beside.setdefault(target, set()).add(source)
    alone = np.array([e.weight + min(0.0, place(e.target, e.source, e.target_from_source)) for e in edges])
    triangles: list[tuple[int, int, int, float]] = []
    for k, edge in enumerate(edges):
        for third in sorted(beside[edge.target] & beside[edge.source]):
            (i, there), (j, back) = between[edge.target, third], between[third, edge.source]
            through = there.target_from_source @ back.target_from_source
            closes = agrees(edge, through, fixed_scale, _chained(there, back))
            triangles.append((k, i, j, IN_TRIANGLE if closes else AGAINST_TRIANGLE))
    weights = alone
    for _ in range(TURNS if triangles else 0):
        believed = expit(weights)
        told = alone.copy()
        for k, i, j, says in triangles:
            told[k] += says * believed[i] * believed[j]
        weights = (weights + np.clip(told, UNSUREST, SUREST)) / 2.0
    return [dataclasses.replace(e, weight=float(w)) for e, w in zip(edges, weights, strict=True)]


def _chained(there: Edge, back: Edge) -> NDArray[np.float64]:
    """The covariance of the product of two edges, as a move about the middle of the last map."""
    by_first = about(
        np.asarray(there.target_from_source.matrix()[:, :2])
        @ np.array([back.target_from_source.x, back.target_from_source.y])
    )
    turned = np.eye(4)
    turned[:2, :2] = there.target_from_source.matrix()[:, :2]
    return np.asarray(by_first @ there.covariance @ by_first.T + turned @ back.covariance @ turned.T)


def _joins(first: Group, second: Group, edges: Sequence[Edge], fixed_scale: bool) -> list[_Join]:
    """The transforms that edges between two groups say, the best supported first; each edge has its say once."""
    left = [e for edge in edges for e in _across(edge, first, second)]
    if not left:
        return []
    hops_first, hops_second = _hops(first), _hops(second)
    found = []
    while left:
        best: tuple[float, list[Edge], Edge] = -math.inf, [], left[0]
        for hypothesis in left:
            agreeing = [
                edge
                for edge in left
                if edge is hypothesis
                or _supports(edge, hypothesis, first, second, hops_first, hops_second, fixed_scale)
            ]
            support = sum(edge.weight for edge in agreeing)
            if support > best[0]:
                best = support, agreeing, hypothesis
        support, agreeing, chosen = best
        told = first.poses[chosen.target] @ chosen.target_from_source @ second.poses[chosen.source].inverse()
        found.append(_Join(told, tuple(agreeing), support))
        left = [edge for edge in left if not any(edge is other for other in agreeing)]
    return sorted(found, key=lambda join: -join.support)


def _across(edge: Edge, first: Group, second: Group) -> list[Edge]:
    """The edge, if it joins the two groups, with its target in the first."""
    if edge.target in first.poses and edge.source in second.poses:
        return [edge]
    if edge.source in first.poses and edge.target in second.poses:
        return [edge.reversed()]
    return []


def _supports(
    edge: Edge,
    hypothesis: Edge,
    first: Group,
    second: Group,
    hops_first: Mapping[tuple[int, int], float],
    hops_second: Mapping[tuple[int, int], float],
    fixed_scale: bool,
) -> bool:
    """Whether an edge agrees with the transform that another one says. The further apart the two lie in their groups,
    the less must they agree."""
    told = first.poses[hypothesis.target] @ hypothesis.target_from_source @ second.poses[hypothesis.source].inverse()
    predicted = first.poses[edge.target].inverse() @ told @ second.poses[edge.source]
    there = first.poses[edge.target].inverse() @ first.poses[hypothesis.target]
    spot = there.apply(np.array([hypothesis.target_from_source.x, hypothesis.target_from_source.y]))
    turned = np.eye(4)
    turned[:2, :2] = there.matrix()[:, :2]
    moved = about(np.array([predicted.x, predicted.y]) - spot) @ turned
    hops = hops_first[edge.target, hypothesis.target] + hops_second[edge.source, hypothesis.source]
    slack = moved @ hypothesis.covariance @ moved.T + hops * edge.covariance
    return agrees(edge, predicted, fixed_scale, slack)


def _hops(group: Group) -> dict[tuple[int, int], float]:
    """How many edges lie between any two maps of a group."""
    members = sorted(group.poses)
    at = {member: k for k, member in enumerate(members)}
    rows = [at[e.target] for e in group.edges]
    cols = [at[e.source] for e in group.edges]
    graph = csr_array((np.ones(len(rows)), (rows, cols)), shape=(len(members), len(members)))
    lengths = shortest_path(graph, directed=False, unweighted=True)
    return {(a, b): float(lengths[at[a], at[b]]) for a in members for b in members}


def _heard(
    first: Group, second: Group, join: _Join, place: Place, but: frozenset[frozenset[int]] = frozenset()
) -> float:
    """What the cells of all pairs across say of a join, ``but`` for some."""
    return sum(
        place(a, b, first_from_a.inverse() @ join.first_from_second @ second_from_b)
        for a, first_from_a in first.poses.items()
        for b, second_from_b in second.poses.items()
        if frozenset((a, b)) not in but
    )


def _spoken(join: _Join, plain: Sequence[Edge]) -> float:
    """What the answers of a join are worth each by itself."""
    ends = _ends(join.edges)
    return sum(edge.weight for edge in plain if frozenset((edge.target, edge.source)) in ends)


def _ends(edges: Sequence[Edge]) -> frozenset[frozenset[int]]:
    return frozenset(frozenset((edge.target, edge.source)) for edge in edges)


def _joined(first: Group, second: Group, join: _Join, edges: Sequence[Edge], fixed_scale: bool) -> Group:
    poses = dict(first.poses)
    poses.update({index: join.first_from_second @ pose for index, pose in second.poses.items()})
    held = (*first.edges, *second.edges, *join.edges)
    return Group(averaged(poses, held, min(poses), fixed_scale), held)


def _mended(group: Group, edges: Sequence[Edge], place: Place, fixed_scale: bool) -> Group:
    """The group with its parts where most speaks for them, on the edges that agree with that in the end."""
    inside = [e for e in edges if e.target in group.poses and e.source in group.poses]
    best = settled(group, inside, fixed_scale)
    most = score([best], inside, place, fixed_scale)
    for _ in range(2 * len(group.poses)):
        for shifted in _shifts(best, inside, place, fixed_scale):
            other = settled(shifted, inside, fixed_scale)
            told = score([other], inside, place, fixed_scale)
            if told > most + LEAST_GAIN:
                best, most = other, told
                break
        else:
            return best
    return best


def settled(group: Group, inside: Sequence[Edge], fixed_scale: bool) -> Group:
    """The group on all edges that agree with its poses, and on no others."""
    for _ in range(3):
        held = tuple(e for e in inside if agrees(e, predicted(group, e.target, e.source), fixed_scale))
        if not _connected(group, held):
            return group
        same = len(held) == len(group.edges)
        group = Group(averaged(group.poses, held, group.root, fixed_scale), held)
        if same:
            break
    return group


def predicted(group: Group, target: int, source: int) -> Similarity2:
    """target_from_source as the group has it."""
    return group.poses[target].inverse() @ group.poses[source]


def _shifts(group: Group, inside: Sequence[Edge], place: Place, fixed_scale: bool) -> list[Group]:
    """The group with some of its maps shifted as one to where other answers put them, the most promising first."""
    if all(agrees(e, predicted(group, e.target, e.source), fixed_scale) for e in inside):
        return []
    found: list[tuple[float, Group]] = []
    for part in _parts(group):
        first, second = _cut(group, part)
        if not (_connected(first, first.edges) and _connected(second, second.edges)):
            continue
        joins = _joins(first, second, inside, fixed_scale)
        now = next((k for k, join in enumerate(joins) if _is_now(join, group)), None)
        if now is None:
            continue
        held = joins[now].support + _heard(first, second, joins[now], place)
        for k, join in enumerate(joins[:MOST_HEARD]):
            if k != now and join.support + BEST_HEARD > held:
                gain = join.support + _heard(first, second, join, place) - held
                found.append((gain, _joined(first, second, join, inside, fixed_scale)))
    found.sort(key=lambda each: -each[0])
    return [shifted for gain, shifted in found[:MOST_TRIED] if gain > WORST_GAIN]


def _parts(group: Group) -> list[frozenset[int]]:
    """What might lie wrong as one: what hangs on one edge of the surest tree, and each map alone."""
    members = sorted(group.poses)
    at = {member: k for k, member in enumerate(members)}
    rows, cols = [at[e.target] for e in group.edges], [at[e.source] for e in group.edges]
    costs = [2.0 * SUREST - e.weight for e in group.edges]
    shape = (len(members), len(members))
    tree = minimum_spanning_tree(csr_array((costs, (rows, cols)), shape=shape)).tocoo()
    parts = [frozenset([member]) for member in members]
    for k in range(tree.nnz):
        others = np.arange(tree.nnz) != k
        cut = csr_array((tree.data[others], (tree.coords[0][others], tree.coords[1][others])), shape=shape)
        labels = connected_components(cut, directed=False)[1]
        side = labels == labels[tree.coords[1][k]]
        parts.append(frozenset(members[i] for i in np.flatnonzero(side).tolist()))
    return [part for part in dict.fromkeys(parts) if len(part) < len(members)]


def _cut(group: Group, part: frozenset[int]) -> tuple[Group, Group]:
    """The rest of a group and a part of it, where they lie now."""

    def of(inside: bool) -> Group:
        poses = {index: pose for index, pose in group.poses.items() if (index in part) == inside}
        return Group(poses, tuple(e for e in group.edges if e.target in poses and e.source in poses))

    return of(False), of(True)


def _is_now(join: _Join, group: Group) -> bool:
    """Whether a join says what the group already has: it holds one of its edges."""
    return bool(_ends(group.edges) & _ends(join.edges))


def _connected(group: Group, held: Sequence[Edge]) -> bool:
    return bool(np.isfinite(list(_hops(Group(group.poses, tuple(held))).values())).all())


def score(groups: Sequence[Group], edges: Sequence[Edge], place: Place, fixed_scale: bool) -> float:
    """What speaks for maps lying so: the weights of the edges that agree, and what the cells of every pair say."""
    told = 0.0
    for group in groups:
        for edge in edges:
            inside = edge.target in group.poses and edge.source in group.poses
            if inside and agrees(edge, predicted(group, edge.target, edge.source), fixed_scale):
                told += edge.weight
        told += sum(place(*pair, predicted(group, *pair)) for pair in combinations(sorted(group.poses), 2))
    return told
