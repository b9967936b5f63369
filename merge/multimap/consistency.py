"""From answers for pairs to groups of maps whose answers agree with one another; wrong answers are left aside.

Sets of mutually consistent answers are what PCM (Mangelson et al. 2018) and CLIPPER (Lusk et al. 2021) look for between
two robots; among whole maps consistency is that of cycles, so groups grow by the transform that most answers between
two of them agree on (as in the sampled graphs of Jiang et al. 2019, but without sampling), and the cells of all maps
that would come to lie on one another are heard before two groups are joined.
"""

from __future__ import annotations

from collections.abc import Sequence

from mapping.geometry.similarity2 import Similarity2
from merge.multimap.cluster import Cluster
from merge.multimap.cluster_alignment import ClusterAlignment, ends, heard, joined, joins
from merge.multimap.cycle_consistency import Place, weighted
from merge.multimap.edge import Edge
from merge.multimap.outlier_rejection import LEAST_GAIN, mended, score

Ends = tuple[int, int]


MOST_STARTS = 6
"""Of the answers between groups that stayed apart so many are believed first, to see what comes of it."""


def consistent(maps: int, edges: Sequence[Edge], place: Place, fixed_scale: bool) -> list[Cluster]:
    """Groups of the maps 0 to ``maps`` - 1, in the order of their lowest members, each with the edges that hold.

    A sure wrong answer that is believed first keeps maps out whose answers are right. So where answers between groups
    are left, groups are grown again from each of those, and the groups kept for which most speaks.
    """
    joining = weighted(edges, place, fixed_scale)
    best = _grown(maps, joining, edges, place, fixed_scale)
    left = [edge for edge in joining if not any(group.holds(edge) for group in best)]
    if not left:
        return best
    most = score(best, edges, place, fixed_scale)
    for start in sorted(left, key=lambda edge: -edge.weight)[:MOST_STARTS]:
        other = _grown(maps, joining, edges, place, fixed_scale, start)
        told = score(other, edges, place, fixed_scale)
        if told > most + LEAST_GAIN:
            best, most = other, told
    return best


def _grown(
    maps: int,
    edges: Sequence[Edge],
    plain: Sequence[Edge],
    place: Place,
    fixed_scale: bool,
    start: Edge | None = None,
) -> list[Cluster]:
    """Groups joined one by one, by what most speaks for; two maps first by the edge to start with."""
    groups: dict[int, Cluster] = {index: Cluster({index: Similarity2.identity()}, ()) for index in range(maps)}
    group_of = list(range(maps))
    if start is not None:
        _join(groups, group_of, ClusterAlignment(start.target_from_source, (start,), start.weight), fixed_scale)
    waiting = _waiting(groups, group_of, edges, list(groups), fixed_scale)
    while True:
        options = [(-ways[0].support, pair) for pair, ways in waiting.items() if ways]
        if not options:
            break
        first, second = min(options)[1]
        join = waiting[first, second].pop(0)
        told = _spoken(join, plain) + heard(groups[first], groups[second], join, place, ends(join.edges))
        if told <= 0.0:
            continue
        _join(groups, group_of, join, fixed_scale)
        waiting = {pair: ways for pair, ways in waiting.items() if not {first, second} & set(pair)}
        waiting |= _waiting(groups, group_of, edges, [first], fixed_scale)
    return [mended(groups[index], plain, place, fixed_scale) for index in sorted(groups)]


def _join(groups: dict[int, Cluster], group_of: list[int], join: ClusterAlignment, fixed_scale: bool) -> None:
    """Make one group of the two that a join joins, under the lower of their indices."""
    first, second = (group_of[end] for end in (join.edges[0].target, join.edges[0].source))
    both = joined(groups.pop(first), groups.pop(second), join, fixed_scale)
    groups[min(first, second)] = both
    group_of[:] = [min(first, second) if group in (first, second) else group for group in group_of]


def _waiting(
    groups: dict[int, Cluster], group_of: Sequence[int], edges: Sequence[Edge], of: Sequence[int], fixed_scale: bool
) -> dict[Ends, list[ClusterAlignment]]:
    """The joins of those groups with any others, by the pair of groups, lower first."""
    across: dict[Ends, list[Edge]] = {}
    for edge in edges:
        low, high = sorted((group_of[edge.target], group_of[edge.source]))
        if low != high and (low in of or high in of):
            across.setdefault((low, high), []).append(edge)
    return {pair: joins(groups[pair[0]], groups[pair[1]], across[pair], fixed_scale) for pair in sorted(across)}


def _spoken(join: ClusterAlignment, plain: Sequence[Edge]) -> float:
    """What the answers of a join are worth each by itself."""
    pairs = ends(join.edges)
    return sum(edge.weight for edge in plain if frozenset((edge.target, edge.source)) in pairs)
