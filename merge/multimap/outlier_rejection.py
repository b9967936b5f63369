"""A group made as good as it can be: parts that lie wrong are shifted, and answers that nothing bears out left out."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree

from merge.multimap.cluster import GATES, Cluster, agreeing, connected, graph, predicted, settled
from merge.multimap.cluster_alignment import ClusterAlignment, ends, heard, joined, joins
from merge.multimap.cycle_consistency import SUREST, Place
from merge.multimap.edge import Edge
from merge.multimap.pose_graph import averaged, leave_one_out_residuals

MOST_HEARD, MOST_TRIED = 8, 3
"""Of a part so many places are heard; of all parts so many shifts are tried."""

MOST_DOUBTED = 6
"""Of the answers that the others do not bear out so many are tried to be left out."""

WORST_GAIN = -3.0
"""What a shift may lose at first sight: one noisy answer puts a part less well than all do that then agree."""

LEAST_GAIN = 0.25
"""A part is only shifted for so much more."""

BEST_HEARD = 12.0
"""The cells say no more than this for a place that few answers speak for."""


def mended(group: Cluster, edges: Sequence[Edge], place: Place, fixed_scale: bool) -> Cluster:
    """The group with its parts where most speaks for them, on edges that agree with it, and each with all others.

    A wrong answer that is nearly right bends a long chain of right ones until it agrees with them. So whatever differs
    from what all the others say together is left out: of the edges that stand against one another, that without which
    most speaks for the rest.
    """
    inside = [edge for edge in edges if group.holds(edge)]
    best = _shifted(settled(group, inside, fixed_scale), inside, place, fixed_scale)
    while True:
        rests = _rests(best, inside, fixed_scale)
        if not rests:
            return best
        told = [score([other], rest, place, fixed_scale) for rest, other in rests]
        inside, best = rests[int(np.argmax(told))]
        best = _shifted(best, inside, place, fixed_scale)


def score(groups: Sequence[Cluster], edges: Sequence[Edge], place: Place, fixed_scale: bool) -> float:
    """What speaks for maps lying so: the weights of the edges that agree, and what the cells of every pair say."""
    told = 0.0
    for group in groups:
        told += sum(edge.weight for edge in agreeing(group, edges, fixed_scale))
        told += sum(place(*pair, predicted(group, *pair)) for pair in combinations(sorted(group.poses), 2))
    return told


def _rests(group: Cluster, inside: Sequence[Edge], fixed_scale: bool) -> list[tuple[list[Edge], Cluster]]:
    """The edges without each one that the others do not bear out, and the group on them."""
    squares = leave_one_out_residuals(group.poses, group.edges, group.root, fixed_scale)
    doubted = [int(k) for k in np.argsort(-squares, kind="stable")[:MOST_DOUBTED] if squares[k] > GATES[fixed_scale]]
    found = []
    for k in doubted:
        held = (*group.edges[:k], *group.edges[k + 1 :])
        rest = [edge for edge in inside if edge is not group.edges[k]]
        other = Cluster(averaged(group.poses, held, group.root, fixed_scale), held)
        found.append((rest, settled(other, rest, fixed_scale)))
    return found


def _shifted(group: Cluster, inside: Sequence[Edge], place: Place, fixed_scale: bool) -> Cluster:
    """The group with its parts where most speaks for them."""
    best, most = group, score([group], inside, place, fixed_scale)
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


def _shifts(group: Cluster, inside: Sequence[Edge], place: Place, fixed_scale: bool) -> list[Cluster]:
    """The group with some of its maps shifted as one to where other answers put them, the most promising first."""
    aside = ends(inside) - ends(agreeing(group, inside, fixed_scale))
    if not aside:
        return []
    found: list[tuple[float, Cluster, Cluster, ClusterAlignment]] = []
    for part in _parts(group):
        if not any(len(pair & part) == 1 for pair in aside):
            continue  # nobody says that it lies elsewhere
        first, second = _cut(group, part)
        if not (connected(first.poses, first.edges) and connected(second.poses, second.edges)):
            continue
        ways = joins(first, second, inside, fixed_scale)
        now = next((k for k, join in enumerate(ways) if _is_now(join, group)), None)
        if now is None:
            continue
        held = ways[now].support + heard(first, second, ways[now], place)
        for k, join in enumerate(ways[:MOST_HEARD]):
            if k != now and join.support + BEST_HEARD > held:
                gain = join.support + heard(first, second, join, place) - held
                found.append((gain, first, second, join))
    found.sort(key=lambda each: -each[0])
    found = [way for way in found[:MOST_TRIED] if way[0] > WORST_GAIN]
    return [joined(first, second, join, fixed_scale) for _, first, second, join in found]


def _parts(group: Cluster) -> list[frozenset[int]]:
    """What might lie wrong as one: what hangs on one edge of the surest tree, and each map alone."""
    members = sorted(group.poses)
    costs = [2.0 * SUREST - edge.weight for edge in group.edges]
    tree = minimum_spanning_tree(graph(members, group.edges, costs)).tocoo()
    parts = [frozenset([member]) for member in members]
    for k in range(tree.nnz):
        others = np.arange(tree.nnz) != k
        ends_left = tree.coords[0][others], tree.coords[1][others]
        labels = connected_components(csr_array((tree.data[others], ends_left), shape=tree.shape), directed=False)[1]
        side = labels == labels[tree.coords[1][k]]
        parts.append(frozenset(members[i] for i in np.flatnonzero(side).tolist()))
    return [part for part in dict.fromkeys(parts) if len(part) < len(members)]


def _cut(group: Cluster, part: frozenset[int]) -> tuple[Cluster, Cluster]:
    """The rest of a group and a part of it, where they lie now."""

    def of(inside: bool) -> Cluster:
        poses = {index: pose for index, pose in group.poses.items() if (index in part) == inside}
        return Cluster(poses, tuple(e for e in group.edges if e.target in poses and e.source in poses))

    return of(False), of(True)


def _is_now(join: ClusterAlignment, group: Cluster) -> bool:
    """Whether a join says what the group already has: it holds one of its edges."""
    return bool(ends(group.edges) & ends(join.edges))
