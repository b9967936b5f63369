"""The graph of maps: answers of pairs as edges, and clusters of maps that edges join."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra, reverse_cuthill_mckee
from scipy.special import chdtri

from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array
from merge.multimap.settings import EdgeSettings, MultimapSettings
from merge.records.prior import Extent
from merge.records.result import PairResult

Pair = tuple[int, int]
"""Indices of two maps, the lower first."""

PairLikelihood = Callable[[int, int, Similarity2], float]
"""Log-odds, from the cells, that ``target_from_source`` is right, by the indices of the maps; 0 if they say nothing."""


@dataclass(frozen=True, eq=False)
class LocalFrame:
    """The frame in which a map enters the graph: cells of its prepared map, about the mean of its walls.

    ``metres_from_local`` leads to the map's metres. ``diagonal`` is the map's size in those cells, ``area`` the number
    of known ones.
    """

    metres_from_local: Similarity2
    diagonal: float
    area: int

    @property
    def extent(self) -> Extent:
        """Extent of the map in its metres."""
        place = self.metres_from_local
        return Extent(self.diagonal * place.scale, math.hypot(place.x, place.y))


@dataclass(frozen=True, eq=False)
class Edge:
    """The answer of a pair: ``target_from_source`` between local frames, by the indices of the maps.

    ``covariance`` (4, 4) is that of a small move of the source about its middle: x, y [cells of the target], yaw [rad]
    and log scale. ``log_odds`` are those that the answer is right.
    """

    target: int
    source: int
    target_from_source: Similarity2
    covariance: NDArray[np.float64]
    log_odds: float

    @property
    def pair(self) -> Pair:
        return min(self.target, self.source), max(self.target, self.source)

    def reversed(self) -> Edge:
        """Express the same answer the other way round."""
        back = self.target_from_source.inverse()
        inverse = np.diag([0.0, 0.0, -1.0, -1.0])
        inverse[:2, :2] = -back.matrix()[:, :2]
        inverse = inverse @ Similarity2(self.target_from_source.x, self.target_from_source.y).adjoint()
        return Edge(self.source, self.target, back, inverse @ self.covariance @ inverse.T, self.log_odds)


@dataclass(frozen=True, eq=False)
class EdgeTable:
    """Edges in arrays: indices (E,), transforms (E,), covariances (E, 4, 4) and log-odds (E,)."""

    targets: NDArray[np.intp]
    sources: NDArray[np.intp]
    target_from_source: Similarity2Array
    covariances: NDArray[np.float64]
    log_odds: NDArray[np.float64]

    @staticmethod
    def of(edges: Sequence[Edge]) -> EdgeTable:
        return EdgeTable(
            np.array([edge.target for edge in edges], np.intp),
            np.array([edge.source for edge in edges], np.intp),
            Similarity2Array.of(edge.target_from_source for edge in edges),
            np.array([edge.covariance for edge in edges], np.float64).reshape(-1, 4, 4),
            np.array([edge.log_odds for edge in edges], np.float64),
        )

    def squared_errors(
        self, predicted: Similarity2Array, fixed_scale: bool, prediction: NDArray[np.float64] | float = 0.0
    ) -> NDArray[np.float64]:
        """Return the squared Mahalanobis distances (..., E) from predicted transforms (..., E).

        ``prediction`` (..., E, 4, 4) is the covariance of those.
        """
        unknowns = 3 if fixed_scale else 4
        error = predicted.minus(self.target_from_source)[..., :unknowns, None]
        covariances = (self.covariances + prediction)[..., :unknowns, :unknowns]
        return np.asarray((error * np.linalg.solve(covariances, error)).sum(axis=(-2, -1)))


@dataclass(frozen=True, eq=False)
class Cluster:
    """Maps that are joined: ``poses`` are root_from_map between local frames, ``edges`` those that agree with them."""

    poses: Mapping[int, Similarity2]
    edges: tuple[Edge, ...]

    @staticmethod
    def of_one(index: int) -> Cluster:
        return Cluster({index: Similarity2.identity()}, ())

    @property
    def root(self) -> int:
        return min(self.poses)

    def contains(self, edge: Edge) -> bool:
        """Check if both maps of an edge are in the cluster."""
        return edge.target in self.poses and edge.source in self.poses

    def target_from_source(self, target: int, source: int) -> Similarity2:
        return self.poses[target].inverse() @ self.poses[source]


def placed_together(first: Cluster, second: Cluster, first_from_second: Similarity2) -> Cluster:
    """Return the poses of both clusters in the frame of the first, without edges."""
    return Cluster({**first.poses, **{index: first_from_second @ pose for index, pose in second.poses.items()}}, ())


@dataclass(frozen=True, eq=False)
class ClusterAlignment:
    """A transform between the roots of two clusters, the edges that agree with it, and their summed log-odds."""

    first_from_second: Similarity2
    edges: tuple[Edge, ...]
    support: float


@dataclass(frozen=True, eq=False)
class ConsistencyModel:
    """The measure by which edges, cells and poses agree: the likelihood of the cells and a chi-square test of edges.

    ``reaches`` [cells] are radii around the local frames of the maps: the likelihood of maps is 0 if these circles do
    not overlap. Without them every pair is evaluated. With ``cells_join`` False, cells that agree do not join two
    clusters without sure answers.
    """

    likelihood: PairLikelihood
    fixed_scale: bool
    settings: MultimapSettings = MultimapSettings()
    reaches: Sequence[float] | None = None
    cells_join: bool = True

    @cached_property
    def gate(self) -> float:
        """Largest squared error of an edge that agrees."""
        return float(chdtri(3 if self.fixed_scale else 4, 1.0 - self.settings.clustering.agreement_quantile))

    def agrees(self, edge: Edge, predicted: Similarity2, prediction: NDArray[np.float64] | float = 0.0) -> bool:
        """Test if an edge and a prediction, with its covariance (4, 4), may both be right."""
        error = EdgeTable.of([edge]).squared_errors(Similarity2Array.of([predicted]), self.fixed_scale, prediction)
        return bool(error[0] < self.gate)

    def neighbours(self, first: Mapping[int, Similarity2], second: Mapping[int, Similarity2]) -> list[Pair]:
        """List the pairs of a map of ``first`` and one of ``second``, posed in one frame, that may overlap, in order.

        The circles are wider by a few cells than those of the likelihood, which rounds poses.
        """
        if self.reaches is None or not (first and second):
            return [(a, b) for a in first for b in second]
        (there, here), radii = (
            (Similarity2Array.of(poses.values()) for poses in (first, second)),
            np.array(self.reaches),
        )
        near = np.abs(there.turn) * (radii[list(first)] + 3.0), np.abs(here.turn) * (radii[list(second)] + 3.0)
        apart = np.abs(there.shift[:, None] - here.shift[None])
        indices = np.argwhere(apart < near[0][:, None] + near[1][None]).tolist()
        rows, cols = list(first), list(second)
        return [(rows[i], cols[k]) for i, k in indices]

    def agreeing(self, cluster: Cluster, edges: Sequence[Edge]) -> tuple[Edge, ...]:
        """Select the edges inside a cluster that agree with its poses."""
        inside = [edge for edge in edges if cluster.contains(edge)]
        if not inside:
            return ()
        targets = Similarity2Array.of(cluster.poses[edge.target] for edge in inside)
        sources = Similarity2Array.of(cluster.poses[edge.source] for edge in inside)
        errors = EdgeTable.of(inside).squared_errors(targets.inverse() @ sources, self.fixed_scale)
        return tuple(edge for edge, error in zip(inside, errors.tolist(), strict=True) if error < self.gate)


def edge_from_answer(
    answer: PairResult,
    indices: Pair,
    frames: Sequence[LocalFrame],
    settings: EdgeSettings = EdgeSettings(),
) -> Edge:
    """Turn the answer of a pair into an edge between its ``indices``, target first.

    Raises ``ValueError`` if the answer has no transform.
    """
    if answer.target_from_source is None:
        raise ValueError(f"the pair {answer.target}, {answer.source} has no transform")
    target, source = frames[indices[0]], frames[indices[1]]
    local = target.metres_from_local.inverse() @ answer.target_from_source @ source.metres_from_local
    smaller = min(target.diagonal, local.scale * source.diagonal)
    sigma = settings.min_sigma_share * smaller
    covariance = np.diag([sigma, sigma, settings.min_yaw_sigma, settings.min_log_scale_sigma]) ** 2
    if answer.covariance is not None:
        covariance = covariance + _local_covariance(answer.target_from_source, answer.covariance, target, source)
    ceiling = settings.max_sigma_share * smaller
    widest = float(np.linalg.eigvalsh(covariance[:2, :2]).max())
    covariance = covariance * min(1.0, ceiling**2 / widest)
    log_odds = max(settings.min_log_odds, _log_odds(answer.confidence, settings.max_log_odds))
    return Edge(*indices, local, covariance, log_odds)


def _log_odds(confidence: float, bound: float) -> float:
    inside = min(max(confidence, 1e-9), 1.0 - 1e-9)
    return min(bound, max(-bound, math.log(inside / (1.0 - inside))))


def _local_covariance(
    metric: Similarity2, covariance: NDArray[np.float64], target: LocalFrame, source: LocalFrame
) -> NDArray[np.float64]:
    """Convert the covariance of x, y, yaw and scale in metres to that of a move about the source's middle in cells."""
    middle = metric.apply(np.array([source.metres_from_local.x, source.metres_from_local.y]))
    about_middle = Similarity2(*(np.array([metric.x, metric.y]) - middle)).adjoint()
    to_log_scale = np.diag([1.0, 1.0, 1.0, 1.0 / metric.scale])
    local_from_metres = target.metres_from_local.inverse()
    to_cells = Similarity2(yaw=local_from_metres.yaw, scale=local_from_metres.scale).adjoint()
    whole = to_cells @ (about_middle @ to_log_scale)
    return np.asarray(whole @ covariance @ whole.T)


def pairs_of(edges: Sequence[Edge]) -> frozenset[Pair]:
    """Return the pairs that edges join."""
    return frozenset(edge.pair for edge in edges)


def in_matching_order(pairs: Sequence[Pair]) -> list[Pair]:
    """Order the pairs so that those of a map and of its partners follow one another.

    Their features are then still in the cache. Source: Cuthill and McKee 1969.
    """
    if not pairs:
        return []
    ends = np.array(pairs).T
    number = int(ends.max()) + 1
    graph = csr_array((np.ones(2 * len(pairs)), np.hstack((ends, ends[::-1]))), shape=(number, number))
    rank = np.argsort(reverse_cuthill_mckee(graph, symmetric_mode=True))
    return sorted(pairs, key=lambda pair: sorted(rank[list(pair)].tolist()))


def is_connected(cluster: Cluster, edges: Sequence[Edge]) -> bool:
    """Check if the edges join all maps of a cluster."""
    return int(connected_components(adjacency(sorted(cluster.poses), edges), directed=False)[0]) == 1


def hop_distances(cluster: Cluster, members: Collection[int]) -> NDArray[np.float64]:
    """Count the edges of a cluster between any two of these ``members`` (M, M), in the order of their indices."""
    ordered = sorted(cluster.poses)
    chosen = np.searchsorted(ordered, sorted(members))
    graph = adjacency(ordered, cluster.edges)
    return np.asarray(dijkstra(graph, directed=False, unweighted=True, indices=chosen), np.float64)[:, chosen]


def chain_confidences(members: Sequence[int], links: Mapping[Pair, float]) -> dict[Pair, float]:
    """Return the confidence of the surest chain of ``links`` between each two members: that of its weakest link.

    ``links`` are the confidences of pairs. Members that no chain joins have 0.
    """
    ordered = sorted(members)
    at = {member: k for k, member in enumerate(ordered)}
    surest = np.zeros((len(ordered), len(ordered)))
    for (a, b), confidence in links.items():
        surest[at[a], at[b]] = surest[at[b], at[a]] = max(surest[at[a], at[b]], confidence)
    for via in range(len(ordered)):
        surest = np.maximum(surest, np.minimum(surest[:, via, None], surest[None, via]))
    return {(a, b): float(surest[at[a], at[b]]) for a in ordered for b in ordered if a < b}


def adjacency(members: Sequence[int], edges: Sequence[Edge], costs: Sequence[float] | None = None) -> csr_array:
    """Return the edges as a sparse matrix (N, N), in the order of the members."""
    at = {member: k for k, member in enumerate(members)}
    ends = [at[edge.target] for edge in edges], [at[edge.source] for edge in edges]
    values = np.ones(len(edges)) if costs is None else np.asarray(costs, np.float64)
    return csr_array((values, ends), shape=(len(members), len(members)))
