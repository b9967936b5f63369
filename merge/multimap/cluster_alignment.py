"""Alignments of two clusters: the transforms that the edges between them suggest, and the support of each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array
from merge.multimap.graph import (
    Cluster,
    ClusterAlignment,
    ConsistencyModel,
    Edge,
    EdgeTable,
    Pair,
    hop_distances,
)


def align_clusters(
    first: Cluster, second: Cluster, edges: Sequence[Edge], model: ConsistencyModel
) -> list[ClusterAlignment]:
    """Group the edges between two clusters by the transform that they suggest, the best supported first.

    Each edge supports one alignment.
    """
    across = [e for edge in edges for e in _across(edge, first, second)]
    if not across:
        return []
    table = EdgeTable.of(across)
    agreement = _agreement(first, second, table, model)
    left = np.ones(len(across), bool)
    found = []
    while left.any():
        candidates = np.flatnonzero(left)
        support = agreement[np.ix_(candidates, candidates)] @ table.log_odds[candidates]
        best = int(candidates[int(np.argmax(support))])
        agreeing = left & agreement[best]
        chosen = across[best]
        transform = first.poses[chosen.target] @ chosen.target_from_source @ second.poses[chosen.source].inverse()
        members = tuple(across[k] for k in np.flatnonzero(agreeing).tolist())
        found.append(ClusterAlignment(transform, members, float(support.max())))
        left &= ~agreeing
    return sorted(found, key=lambda alignment: -alignment.support)


def cell_log_odds(
    first: Cluster,
    second: Cluster,
    first_from_second: Similarity2,
    model: ConsistencyModel,
    but: frozenset[Pair] = frozenset(),
) -> float:
    """Sum the log-odds, from the cells, of all pairs across two clusters, ``but`` for some."""
    moved = {b: first_from_second @ second_from_b for b, second_from_b in second.poses.items()}
    return sum(
        model.likelihood(a, b, first.poses[a].inverse() @ first_from_second @ second.poses[b])
        for a, b in model.neighbours(first.poses, moved)
        if (min(a, b), max(a, b)) not in but
    )


def _across(edge: Edge, first: Cluster, second: Cluster) -> list[Edge]:
    """Return the edge with its target in the first cluster, if it joins the two."""
    if edge.target in first.poses and edge.source in second.poses:
        return [edge]
    if edge.source in first.poses and edge.target in second.poses:
        return [edge.reversed()]
    return []


def _agreement(first: Cluster, second: Cluster, table: EdgeTable, model: ConsistencyModel) -> NDArray[np.bool_]:
    """Test each edge (columns) against the alignment that each edge (rows) suggests: (E, E).

    The prediction has the covariance of the edge that makes it, and that of the steps inside the clusters between the
    two edges.
    """
    first_from_target = Similarity2Array.of(first.poses[index] for index in table.targets.tolist())
    second_from_source = Similarity2Array.of(second.poses[index] for index in table.sources.tolist())
    suggested = first_from_target @ table.target_from_source @ second_from_source.inverse()
    back = first_from_target.inverse()
    predicted = back[None] @ suggested[:, None] @ second_from_source[None]
    between = back[None] @ first_from_target[:, None]
    # The move of one edge about its own source, expressed about the source of the other.
    own_source = between.turn * table.target_from_source.shift[:, None] + between.shift
    transport = Similarity2Array(between.turn, own_source - predicted.shift).adjoint()
    covariances = transport @ table.covariances[:, None] @ transport.swapaxes(-1, -2)
    covariances += _hops_between(first, second, table)[..., None, None] * table.covariances[None]
    agreeing = table.squared_errors(predicted, model.fixed_scale, covariances) < model.gate
    np.fill_diagonal(agreeing, True)
    return np.asarray(agreeing, np.bool_)


def _hops_between(first: Cluster, second: Cluster, table: EdgeTable) -> NDArray[np.float64]:
    """Count the edges inside the clusters between the ends of each two edges: (E, E)."""
    total = np.zeros((len(table.log_odds),) * 2)
    for cluster, indices in ((first, table.targets), (second, table.sources)):
        members, at = np.unique(indices, return_inverse=True)
        total += hop_distances(cluster, members.tolist())[np.ix_(at, at)]
    return total
