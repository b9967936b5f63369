"""Maps that are joined, and whether answers agree with how they lie."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, shortest_path
from scipy.special import chdtri

from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array
from merge.multimap.edge import Edge, EdgeTable
from merge.multimap.pose_graph import averaged

QUANTILE = 0.999
"""Of right answers so many pass as agreeing with one another."""

GATES = {fixed: float(chdtri(3 if fixed else 4, 1.0 - QUANTILE)) for fixed in (True, False)}
"""What the square of a difference may be, by whether the scale is fixed: a chi-square test."""


@dataclass(frozen=True, eq=False)
class Cluster:
    """Maps that are joined: ``poses`` are root_from_map between local frames, ``edges`` those that agree with them."""

    poses: Mapping[int, Similarity2]
    edges: tuple[Edge, ...]

    @property
    def root(self) -> int:
        return min(self.poses)

    def holds(self, edge: Edge) -> bool:
        """Whether both maps of an edge are in it."""
        return edge.target in self.poses and edge.source in self.poses


def predicted(group: Cluster, target: int, source: int) -> Similarity2:
    """target_from_source as the group has it."""
    return group.poses[target].inverse() @ group.poses[source]


def agrees(edge: Edge, told: Similarity2, fixed_scale: bool, slack: NDArray[np.float64] | float = 0.0) -> bool:
    """Whether an answer and what others tell of its pair may both be right, ``slack`` (4, 4) being how far off those
    may be."""
    square = EdgeTable.of([edge]).misfits(Similarity2Array.of([told]), fixed_scale, slack)
    return bool(square[0] < GATES[fixed_scale])


def agreeing(group: Cluster, edges: Sequence[Edge], fixed_scale: bool) -> tuple[Edge, ...]:
    """Those edges between maps of the group that agree with their poses."""
    inside = [edge for edge in edges if group.holds(edge)]
    if not inside:
        return ()
    targets, sources = (
        Similarity2Array.of(group.poses[i] for i in ends) for ends in zip(*map(_ends, inside), strict=True)
    )
    squares = EdgeTable.of(inside).misfits(targets.inverse() @ sources, fixed_scale)
    return tuple(edge for edge, square in zip(inside, squares.tolist(), strict=True) if square < GATES[fixed_scale])


def settled(group: Cluster, edges: Sequence[Edge], fixed_scale: bool) -> Cluster:
    """The group on all edges that agree with its poses, and on no others."""
    for _ in range(3):
        held = agreeing(group, edges, fixed_scale)
        if not connected(group.poses, held):
            return group
        same = len(held) == len(group.edges)
        group = Cluster(averaged(group.poses, held, group.root, fixed_scale), held)
        if same:
            break
    return group


def connected(members: Mapping[int, object], edges: Sequence[Edge]) -> bool:
    """Whether the edges join all members."""
    return int(connected_components(graph(sorted(members), edges), directed=False)[0]) == 1


def hops(group: Cluster) -> NDArray[np.float64]:
    """How many edges lie between any two maps of a group (N, N), in the order of their indices."""
    return np.asarray(
        shortest_path(graph(sorted(group.poses), group.edges), directed=False, unweighted=True), np.float64
    )


def graph(members: Sequence[int], edges: Sequence[Edge], costs: Sequence[float] | None = None) -> csr_array:
    """The edges as a sparse matrix, in the order of the members."""
    at = {member: k for k, member in enumerate(members)}
    ends = [at[edge.target] for edge in edges], [at[edge.source] for edge in edges]
    values = np.ones(len(edges)) if costs is None else np.asarray(costs, np.float64)
    return csr_array((values, ends), shape=(len(members), len(members)))


def _ends(edge: Edge) -> tuple[int, int]:
    return edge.target, edge.source
