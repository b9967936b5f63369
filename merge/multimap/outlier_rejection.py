"""Rejection of wrong answers inside a cluster: parts in a wrong place are shifted, contradicted answers left out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree

from merge.multimap.cluster_alignment import align_clusters, cell_log_odds
from merge.multimap.graph import (
    Cluster,
    ClusterAlignment,
    ConsistencyModel,
    Edge,
    adjacency,
    is_connected,
    pairs_of,
)
from merge.multimap.pose_graph import join_clusters, leave_one_out_residuals, optimise_poses, refit_cluster


def reject_outliers(cluster: Cluster, edges: Sequence[Edge], model: ConsistencyModel) -> Cluster:
    """Move the parts of a cluster to the poses with the largest log-odds, and leave out the edges that disagree.

    A wrong answer that is nearly right bends a long chain of right ones until it agrees with them. So each edge is
    also tested against the prediction of all others. Of the edges that contradict one another, the one is left out
    without which the rest has the largest log-odds.
    """
    inside = [edge for edge in edges if cluster.contains(edge)]
    best = _shift_parts(refit_cluster(cluster, inside, model), inside, model)
    while True:
        reduced = _without_suspects(best, inside, model)
        if not reduced:
            return best
        log_odds = [total_log_odds([other], rest, model) for rest, other in reduced]
        inside, best = reduced[int(np.argmax(log_odds))]
        best = _shift_parts(best, inside, model)


def total_log_odds(clusters: Sequence[Cluster], edges: Sequence[Edge], model: ConsistencyModel) -> float:
    """Sum the log-odds of the edges that agree with the poses, and those of the cells of every pair."""
    total = 0.0
    for cluster in clusters:
        total += sum(edge.log_odds for edge in model.agreeing(cluster, edges))
        ordered = {index: cluster.poses[index] for index in sorted(cluster.poses)}
        total += sum(
            model.likelihood(a, b, cluster.target_from_source(a, b))
            for a, b in model.neighbours(ordered, ordered)
            if a < b
        )
    return total


def _without_suspects(
    cluster: Cluster, inside: Sequence[Edge], model: ConsistencyModel
) -> list[tuple[list[Edge], Cluster]]:
    """Leave out each edge that the others contradict: the edges that remain, and the cluster on them."""
    limits = model.settings.rejection
    errors = leave_one_out_residuals(
        cluster.poses, cluster.edges, cluster.root, model.fixed_scale, limits.min_redundancy
    )
    worst = np.argsort(-errors, kind="stable")[: limits.suspects]
    found = []
    for k in (int(k) for k in worst if errors[k] > model.gate):
        kept = (*cluster.edges[:k], *cluster.edges[k + 1 :])
        rest = [edge for edge in inside if edge is not cluster.edges[k]]
        other = Cluster(optimise_poses(cluster.poses, kept, cluster.root, model.fixed_scale), kept)
        found.append((rest, refit_cluster(other, rest, model)))
    return found


def _shift_parts(cluster: Cluster, inside: Sequence[Edge], model: ConsistencyModel) -> Cluster:
    """Shift parts of a cluster while its log-odds grow."""
    best, most = cluster, total_log_odds([cluster], inside, model)
    for _ in range(2 * len(cluster.poses)):
        for shifted in _shifts(best, inside, model):
            other = refit_cluster(shifted, inside, model)
            log_odds = total_log_odds([other], inside, model)
            if log_odds > most + model.settings.rejection.min_gain:
                best, most = other, log_odds
                break
        else:
            return best
    return best


def _shifts(cluster: Cluster, inside: Sequence[Edge], model: ConsistencyModel) -> list[Cluster]:
    """Shift single parts of a cluster to where contradicted edges put them, the largest gain first."""
    limits = model.settings.rejection
    contradicted = pairs_of(inside) - pairs_of(model.agreeing(cluster, inside))
    if not contradicted:
        return []
    found: list[tuple[float, Cluster, Cluster, ClusterAlignment]] = []
    for part in _parts(cluster, model):
        if not any((a in part) != (b in part) for a, b in contradicted):
            continue  # no edge puts the part elsewhere
        first, second = _split(cluster, part)
        if not (is_connected(first, first.edges) and is_connected(second, second.edges)):
            continue
        alignments = align_clusters(first, second, inside, model)
        current = next((k for k, alignment in enumerate(alignments) if _is_current(alignment, cluster)), None)
        if current is None:
            continue
        now = alignments[current]
        log_odds = now.support + cell_log_odds(first, second, now.first_from_second, model)
        for k, alignment in enumerate(alignments[: limits.alignments]):
            sure = model.cells_join or max(edge.log_odds for edge in alignment.edges) > 0.0
            if k != current and sure and alignment.support + limits.max_cell_gain > log_odds:
                cells = cell_log_odds(first, second, alignment.first_from_second, model)
                found.append((alignment.support + cells - log_odds, first, second, alignment))
    found.sort(key=lambda each: -each[0])
    tried = [shift for shift in found[: limits.shifts] if shift[0] > limits.min_first_gain]
    return [join_clusters(first, second, alignment, model) for _, first, second, alignment in tried]


def _parts(cluster: Cluster, model: ConsistencyModel) -> list[frozenset[int]]:
    """List the parts that may be shifted as one: each map, and each branch of the maximum spanning tree of edges."""
    members = sorted(cluster.poses)
    costs = [2.0 * model.settings.clustering.max_edge_log_odds - edge.log_odds for edge in cluster.edges]
    tree = minimum_spanning_tree(adjacency(members, cluster.edges, costs)).tocoo()
    parts = [frozenset([member]) for member in members]
    for k in range(tree.nnz):
        others = np.arange(tree.nnz) != k
        ends = tree.coords[0][others], tree.coords[1][others]
        labels = connected_components(csr_array((tree.data[others], ends), shape=tree.shape), directed=False)[1]
        side = labels == labels[tree.coords[1][k]]
        parts.append(frozenset(members[i] for i in np.flatnonzero(side).tolist()))
    return [part for part in dict.fromkeys(parts) if len(part) < len(members)]


def _split(cluster: Cluster, part: frozenset[int]) -> tuple[Cluster, Cluster]:
    """Split a cluster into the rest and a part, without moving either."""

    def side(inside: bool) -> Cluster:
        poses = {index: pose for index, pose in cluster.poses.items() if (index in part) == inside}
        return Cluster(poses, tuple(e for e in cluster.edges if e.target in poses and e.source in poses))

    return side(False), side(True)


def _is_current(alignment: ClusterAlignment, cluster: Cluster) -> bool:
    """Check if an alignment is the one that the cluster has: it shares an edge with it."""
    return bool(pairs_of(cluster.edges) & pairs_of(alignment.edges))
