"""Groups joined though every pair between them was refused: refused answers that agree, borne out by all maps at once.

Two refused answers of different pairs that put one group at the same place on another rarely do so by chance. But maps
that share what misleads them agree as well: so what has been merged of either group is matched as one map, of which a
wall that several maps know is one wall, and whose rivals are looked for everywhere in it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.fusion import fuse
from merge.multimap.cluster import Cluster, agrees
from merge.multimap.cluster_alignment import ClusterAlignment, ends, joins
from merge.multimap.edge import Edge
from merge.records.result import PairResult

LEAST_AGREEING = 2
"""So many refused answers, each of another pair, must agree before anything else is looked at."""


def agreeing_refusals(
    first: Cluster,
    second: Cluster,
    answers: Iterable[PairResult],
    edge: Callable[[PairResult], Edge],
    fixed_scale: bool,
) -> list[ClusterAlignment]:
    """The places of one group on another that enough refused answers, or what else they found, agree on."""
    edges = [edge(place) for answer in answers for place in _places(answer)]
    return [join for join in joins(first, second, edges, fixed_scale) if len(ends(join.edges)) >= LEAST_AGREEING]


def borne_out(
    join: ClusterAlignment, first: Cluster, second: Cluster, first_from_second: Similarity2, fixed_scale: bool
) -> list[Edge]:
    """Those edges of a join that agree with where the groups were found to lie."""

    def told(edge: Edge) -> Similarity2:
        return first.poses[edge.target].inverse() @ first_from_second @ second.poses[edge.source]

    return [edge for edge in join.edges if agrees(edge, told(edge), fixed_scale, edge.covariance)]


def quilt(grids: Iterable[tuple[Similarity2, OccupancyGrid]]) -> OccupancyGrid:
    """Maps, each with its ``reference_from_map``, the reference first, as one."""
    placed = [(place, grid.cropped()) for place, grid in grids]
    return placed[0][1] if len(placed) == 1 else fuse(placed[0][1].frame, placed)


def _places(answer: PairResult) -> Iterator[PairResult]:
    """A refused answer, and what else it found, as answers by themselves."""
    if answer.accepted or answer.decided_by != "pair" or answer.target_from_source is None:
        return
    yield answer
    for other in answer.alternatives:
        yield dataclasses.replace(answer, target_from_source=other.target_from_source)
