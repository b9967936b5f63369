"""Merging of clusters although every pair between them was refused.

Two refused answers of different pairs that suggest the same alignment of two clusters rarely do so by chance. But maps
that share what misleads them agree as well. So each cluster is fused to one map, and the two are matched like any pair:
a wall that several maps know is then one wall, and ambiguity is searched in all that they know.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.fusion import fuse
from merge.multimap.cluster_alignment import align_clusters
from merge.multimap.graph import Cluster, ClusterAlignment, Edge, Pair, pairs_of
from merge.multimap.team import Answers, Team
from merge.pair.pipeline import match
from merge.pair.task import PairTask
from merge.records.result import PairResult


@dataclasses.dataclass(frozen=True, eq=False)
class FusedMatch:
    """The accepted match of two fused clusters, and the refused pairs that agree with it."""

    first_from_second: Similarity2
    confidence: float
    pairs: tuple[Pair, ...]


def match_fused_clusters(team: Team, answers: Answers, first: Cluster, second: Cluster) -> FusedMatch | None:
    """Match two clusters as one map each, if enough refused answers suggest the same alignment.

    None if they do not, the match is refused, it does not agree with those answers, or a prior contradicts it; and for
    an indexed team, of whose many places some look like any map.
    """
    if team.indexed:
        return None
    across = sorted((min(a, b), max(a, b)) for a in first.poses for b in second.poses)
    least = team.settings.multimap.merging.min_agreeing_refusals
    edges = [team.edge(each) for pair in across if pair in answers for each in _refused_answers(answers[pair])]
    suggested = [
        alignment
        for alignment in align_clusters(first, second, edges, team.model)
        if len(pairs_of(alignment.edges)) >= least
    ]
    if not suggested:
        return None
    (target, target_grid), (source, source_grid) = fuse_cluster(team, first), fuse_cluster(team, second)
    units = team.maps.units[target], team.maps.units[source]
    task = PairTask(("merged", "merged"), (target_grid, source_grid), units, team.scale, team.settings, team.seed)
    (found,) = team.run(match, [task])
    if not found.accepted or found.target_from_source is None:
        return None
    local = team.local(found.target_from_source, target, source)
    first_from_second = first.poses[target] @ local @ second.poses[source].inverse()
    for alignment in suggested:
        pairs = pairs_of(_agreeing(team, alignment, first, second, first_from_second))
        if len(pairs) >= least and team.priors_allow(first, second, first_from_second):
            return FusedMatch(first_from_second, found.confidence, tuple(sorted(pairs)))
    return None


def fuse_cluster(team: Team, cluster: Cluster) -> tuple[int, OccupancyGrid]:
    """Fuse a cluster in the frame of its largest map: the index of that, and the grid."""
    members = sorted(cluster.poses, key=lambda k: -team.frames[k].area * cluster.poses[k].scale ** 2)
    names = [team.maps.names[k] for k in members]
    grids = [(team.metric(cluster, names[0], name), team.maps.grids[team.index(name)].cropped()) for name in names]
    return members[0], grids[0][1] if len(grids) == 1 else fuse(
        grids[0][1].frame, grids, settings=team.settings.merged_grid
    )


def _refused_answers(answer: PairResult) -> Iterator[PairResult]:
    """Yield a refused answer and its alternatives, each as an answer by itself."""
    if answer.accepted or answer.decided_by != "pair" or answer.target_from_source is None:
        return
    yield answer
    for other in answer.alternatives:
        yield dataclasses.replace(answer, target_from_source=other.target_from_source)


def _agreeing(
    team: Team, alignment: ClusterAlignment, first: Cluster, second: Cluster, first_from_second: Similarity2
) -> list[Edge]:
    """Select the edges of an alignment that agree with the match of the fused clusters."""

    def predicted(edge: Edge) -> Similarity2:
        return first.poses[edge.target].inverse() @ first_from_second @ second.poses[edge.source]

    return [edge for edge in alignment.edges if team.model.agrees(edge, predicted(edge), edge.covariance)]
