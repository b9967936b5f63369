"""How two groups may be joined: the transforms that answers between them say, and how many say each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array
from merge.multimap.cluster import GATES, Cluster, hops
from merge.multimap.cycle_consistency import Place
from merge.multimap.edge import Edge, EdgeTable
from merge.multimap.pose_graph import averaged


@dataclass(frozen=True, eq=False)
class ClusterAlignment:
    """How two groups may be joined, and the edges that say so."""

    first_from_second: Similarity2
    edges: tuple[Edge, ...]
    support: float


def joins(first: Cluster, second: Cluster, edges: Sequence[Edge], fixed_scale: bool) -> list[ClusterAlignment]:
    """The transforms that edges between two groups say, the best supported first; each edge has its say once."""
    across = [e for edge in edges for e in _across(edge, first, second)]
    if not across:
        return []
    table = EdgeTable.of(across)
    supports = _supports(first, second, table, fixed_scale)
    left = np.ones(len(across), bool)
    found = []
    while left.any():
        candidates = np.flatnonzero(left)
        support = supports[np.ix_(candidates, candidates)] @ table.weights[candidates]
        best = int(candidates[int(np.argmax(support))])
        agreeing = left & supports[best]
        chosen = across[best]
        told = first.poses[chosen.target] @ chosen.target_from_source @ second.poses[chosen.source].inverse()
        members = tuple(across[k] for k in np.flatnonzero(agreeing).tolist())
        found.append(ClusterAlignment(told, members, float(support.max())))
        left &= ~agreeing
    return sorted(found, key=lambda join: -join.support)


def joined(first: Cluster, second: Cluster, join: ClusterAlignment, fixed_scale: bool) -> Cluster:
    """Both groups as one, averaged over all their edges."""
    poses = dict(first.poses)
    poses.update({index: join.first_from_second @ pose for index, pose in second.poses.items()})
    held = (*first.edges, *second.edges, *join.edges)
    return Cluster(averaged(poses, held, min(poses), fixed_scale), held)


def heard(
    first: Cluster, second: Cluster, join: ClusterAlignment, place: Place, but: frozenset[frozenset[int]] = frozenset()
) -> float:
    """What the cells of all pairs across say of a join, ``but`` for some."""
    return sum(
        place(a, b, first_from_a.inverse() @ join.first_from_second @ second_from_b)
        for a, first_from_a in first.poses.items()
        for b, second_from_b in second.poses.items()
        if frozenset((a, b)) not in but
    )


def ends(edges: Sequence[Edge]) -> frozenset[frozenset[int]]:
    """The pairs that edges join."""
    return frozenset(frozenset((edge.target, edge.source)) for edge in edges)


def _across(edge: Edge, first: Cluster, second: Cluster) -> list[Edge]:
    """The edge, if it joins the two groups, with its target in the first."""
    if edge.target in first.poses and edge.source in second.poses:
        return [edge]
    if edge.source in first.poses and edge.target in second.poses:
        return [edge.reversed()]
    return []


def _supports(first: Cluster, second: Cluster, table: EdgeTable, fixed_scale: bool) -> NDArray[np.bool_]:
    """Whether each edge (columns) agrees with the transform that each one (rows) says. The further apart the two lie in
    their groups, the less must they agree."""
    there = Similarity2Array.of(first.poses[index] for index in table.targets.tolist())
    here = Similarity2Array.of(second.poses[index] for index in table.sources.tolist())
    said = there @ table.found @ here.inverse()
    back = there.inverse()
    predicted = back[None] @ said[:, None] @ here[None]
    between = back[None] @ there[:, None]
    spot = between.turn * table.found.shift[:, None] + between.shift
    moved = Similarity2Array(between.turn, spot - predicted.shift).adjoint()
    slack = moved @ table.covariances[:, None] @ moved.swapaxes(-1, -2)
    slack += _apart(first, second, table)[..., None, None] * table.covariances[None]
    agreeing = table.misfits(predicted, fixed_scale, slack) < GATES[fixed_scale]
    np.fill_diagonal(agreeing, True)
    return np.asarray(agreeing, np.bool_)


def _apart(first: Cluster, second: Cluster, table: EdgeTable) -> NDArray[np.float64]:
    """How many edges of the groups lie between the ends of each two (K, K)."""
    total = np.zeros((len(table.weights),) * 2)
    for group, indices in ((first, table.targets), (second, table.sources)):
        at = np.searchsorted(sorted(group.poses), indices)
        total += hops(group)[np.ix_(at, at)]
    return total
