"""Clusters of maps whose answers agree with one another; wrong answers are left out.

PCM (Mangelson et al. 2018) and CLIPPER (Lusk et al. 2021) look for sets of mutually consistent answers between two
robots. Among whole maps consistency is that of cycles. So clusters grow by the transform that most answers between two
of them support (as in the sampled graphs of Jiang et al. 2019, but without sampling), and two clusters are joined only
if the cells of all maps that would then overlap do not contradict it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from mapping.geometry.similarity2 import Similarity2
from merge.multimap.cluster_alignment import align_clusters, cell_log_odds
from merge.multimap.graph import Cluster, ClusterAlignment, ConsistencyModel, Edge, Pair, pairs_of
from merge.multimap.outlier_rejection import reject_outliers, total_log_odds
from merge.multimap.pose_graph import join_clusters

Clusters = Mapping[int, Cluster]
"""Clusters by their roots."""


def cluster_maps(maps: int, edges: Sequence[Edge], model: ConsistencyModel) -> list[Cluster]:
    """Cluster the maps 0 to ``maps`` - 1 by their edges, in the order of the clusters' roots.

    A wrong answer with high log-odds that is used first keeps maps out whose answers are right. So if answers between
    clusters are left, clusters are grown again from each of those, and the clusters with the largest log-odds kept.
    """
    weighted = weigh_by_cycles(edges, model)
    best = _grow(maps, weighted, edges, model)
    contradicted = [
        each
        for each, edge in zip(weighted, edges, strict=True)
        if (model.cells_join or edge.log_odds > 0.0) and not any(cluster.contains(each) for cluster in best)
    ]
    if not contradicted:
        return best
    most = total_log_odds(best, edges, model)
    for start in sorted(contradicted, key=lambda edge: -edge.log_odds)[: model.settings.clustering.restarts]:
        other = _grow(maps, weighted, edges, model, start)
        log_odds = total_log_odds(other, edges, model)
        if log_odds > most + model.settings.rejection.min_gain:
            best, most = other, log_odds
    return best


def _grow(
    maps: int,
    weighted: Sequence[Edge],
    edges: Sequence[Edge],
    model: ConsistencyModel,
    start: Edge | None = None,
) -> list[Cluster]:
    """Join clusters one by one, the best supported alignment first; two maps before that by the edge to start with."""
    clusters: Clusters = {index: Cluster.of_one(index) for index in range(maps)}
    if start is not None:
        only = ClusterAlignment(start.target_from_source, (start,), start.log_odds)
        clusters = _joined(clusters, start.target, start.source, only, model)
    options = _alignments(clusters, weighted, clusters, model)
    while True:
        ranked = [(-alignments[0].support, roots) for roots, alignments in options.items() if alignments]
        if not ranked:
            break
        first, second = min(ranked)[1]
        alignment = options[first, second].pop(0)
        pairs = pairs_of(alignment.edges)
        log_odds = [edge.log_odds for edge in edges if edge.pair in pairs]
        cells = cell_log_odds(clusters[first], clusters[second], alignment.first_from_second, model, but=pairs)
        if sum(log_odds) + cells <= 0.0 or not (model.cells_join or max(log_odds) + min(0.0, cells) > 0.0):
            continue
        clusters = _joined(clusters, first, second, alignment, model)
        options = {roots: alignments for roots, alignments in options.items() if not {first, second} & set(roots)}
        options |= _alignments(clusters, weighted, [first], model)
    return [reject_outliers(clusters[root], edges, model) for root in sorted(clusters)]


def _joined(
    clusters: Clusters, first: int, second: int, alignment: ClusterAlignment, model: ConsistencyModel
) -> Clusters:
    """Replace two clusters by the one that an alignment makes of them."""
    joined = join_clusters(clusters[first], clusters[second], alignment, model)
    rest = {root: cluster for root, cluster in clusters.items() if root not in (first, second)}
    return {**rest, joined.root: joined}


def _alignments(
    clusters: Clusters, edges: Sequence[Edge], roots: Collection[int], model: ConsistencyModel
) -> dict[Pair, list[ClusterAlignment]]:
    """Align the clusters with these ``roots`` to all others, by the two roots, lower first."""
    root_of = {member: root for root, cluster in clusters.items() for member in cluster.poses}
    across: dict[Pair, list[Edge]] = {}
    for edge in edges:
        low, high = sorted((root_of[edge.target], root_of[edge.source]))
        if low != high and (low in roots or high in roots):
            across.setdefault((low, high), []).append(edge)
    return {pair: align_clusters(clusters[pair[0]], clusters[pair[1]], across[pair], model) for pair in sorted(across)}


def weigh_by_cycles(edges: Sequence[Edge], model: ConsistencyModel) -> list[Edge]:
    """Adapt the log-odds of each edge to its own cells and to the triangles of edges that it is in.

    A triangle counts for an edge as far as its two others are probably right, which a fixed-point iteration finds
    (after Zach et al. 2010).
    """
    settings = model.settings.clustering
    between = {(e.target, e.source): (k, e) for k, edge in enumerate(edges) for e in (edge, edge.reversed())}
    beside: dict[int, set[int]] = {}
    for target, source in between:
        beside.setdefault(target, set()).add(source)
    alone = np.array([e.log_odds + min(0.0, model.likelihood(e.target, e.source, e.target_from_source)) for e in edges])
    triangles: list[tuple[int, int, int, float]] = []
    for k, edge in enumerate(edges):
        for third in sorted(beside[edge.target] & beside[edge.source]):
            (i, first), (j, second) = between[edge.target, third], between[third, edge.source]
            chain = first.target_from_source @ second.target_from_source
            closes = model.agrees(edge, chain, _chain_covariance(first, second))
            triangles.append((k, i, j, settings.cycle_log_odds if closes else -settings.cycle_log_odds))
    log_odds = alone
    for _ in range(settings.cycle_iterations if triangles else 0):
        probabilities = expit(log_odds)
        updated = alone.copy()
        for k, i, j, gain in triangles:
            updated[k] += gain * probabilities[i] * probabilities[j]
        updated = np.clip(updated, settings.min_edge_log_odds, settings.max_edge_log_odds)
        log_odds = (log_odds + updated) / 2.0
    return [dataclasses.replace(e, log_odds=float(value)) for e, value in zip(edges, log_odds, strict=True)]


def _chain_covariance(first: Edge, second: Edge) -> NDArray[np.float64]:
    """Return the covariance (4, 4) of the product of two edges, as a move about the middle of the last map."""
    one, other = first.target_from_source, second.target_from_source
    linear = Similarity2(yaw=one.yaw, scale=one.scale)
    by_first = Similarity2(*-linear.apply([other.x, other.y])).adjoint()
    by_second = linear.adjoint()
    return np.asarray(by_first @ first.covariance @ by_first.T + by_second @ second.covariance @ by_second.T)
