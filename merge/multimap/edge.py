"""Answers for pairs as the edges of a graph of maps, in frames in which they can be compared and averaged."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array
from mapping.map_set import MapSet
from merge.pair.feature_cache import FeatureCache, metres_from_prepared
from merge.records.result import PairResult

FLOOR_SHARE = 0.01
"""By how much two right answers may differ though nothing shows it, as a share of the smaller map's diagonal: each fits
its own part of maps that drift."""

FLOOR_TURN = math.radians(0.7)
FLOOR_GROWTH = 0.01

LEAST_WEIGHT = 0.2
"""Log-odds of an answer that was accepted however unsure it is."""

CEILING_SHARE = 0.05
"""An answer is no less certain than by this share, or anything would agree with it."""


@dataclass(frozen=True, eq=False)
class LocalFrame:
    """Where a map stands: ``metres_from_local`` takes its local frame, in cells of its chart about the middle of its
    walls, to its metres; ``diagonal`` is its size, in those cells, and ``area`` the number that it knows."""

    metres_from_local: Similarity2
    diagonal: float
    area: int

    @staticmethod
    def all(maps: MapSet, shelf: FeatureCache) -> tuple[LocalFrame, ...]:
        """Of every map of a team."""
        found = []
        for grid in maps.grids:
            chart = shelf.chart(grid)
            middle = Similarity2(float(chart.middle[0]), float(chart.middle[1]))
            placed = metres_from_prepared(grid.frame, chart) @ middle
            found.append(LocalFrame(placed, max(1.0, chart.diagonal), int(np.count_nonzero(chart.grid.known))))
        return tuple(found)


@dataclass(frozen=True, eq=False)
class Edge:
    """What one answer says: ``target_from_source`` between local frames, and the ``covariance`` (4, 4) of a move of the
    source about its middle: x, y [cells of the target], turn [rad], growth [log scale]. ``weight`` are the log-odds
    that it is right."""

    target: int
    source: int
    target_from_source: Similarity2
    covariance: NDArray[np.float64]
    weight: float

    def reversed(self) -> Edge:
        """The same, told the other way round."""
        back = self.target_from_source.inverse()
        moved = np.diag([0.0, 0.0, -1.0, -1.0])
        moved[:2, :2] = -back.matrix()[:, :2]
        # About the target's middle, which lies away from the source's.
        moved = moved @ Similarity2(self.target_from_source.x, self.target_from_source.y).adjoint()
        return Edge(self.source, self.target, back, moved @ self.covariance @ moved.T, self.weight)


@dataclass(frozen=True, eq=False)
class EdgeTable:
    """Edges in arrays: indices (E,), motions (E,), covariances (E, 4, 4) and weights (E,)."""

    targets: NDArray[np.intp]
    sources: NDArray[np.intp]
    found: Similarity2Array
    covariances: NDArray[np.float64]
    weights: NDArray[np.float64]

    @staticmethod
    def of(edges: Sequence[Edge]) -> EdgeTable:
        return EdgeTable(
            np.array([edge.target for edge in edges], np.intp),
            np.array([edge.source for edge in edges], np.intp),
            Similarity2Array.of(edge.target_from_source for edge in edges),
            np.array([edge.covariance for edge in edges], np.float64).reshape(-1, 4, 4),
            np.array([edge.weight for edge in edges], np.float64),
        )

    def misfits(
        self, predicted: Similarity2Array, fixed_scale: bool, slack: NDArray[np.float64] | float = 0.0
    ) -> NDArray[np.float64]:
        """By how much each differs from what others predict: the square (..., E) of the difference, by its covariance
        and that of the prediction, ``slack`` (..., E, 4, 4)."""
        unknowns = 3 if fixed_scale else 4
        off = predicted.minus(self.found)[..., :unknowns, None]
        covariances = (self.covariances + slack)[..., :unknowns, :unknowns]
        return np.asarray((off * np.linalg.solve(covariances, off)).sum(axis=(-2, -1)))


def edge_of(pair: PairResult, indices: tuple[int, int], grounds: Sequence[LocalFrame]) -> Edge:
    """The edge of an answer that has a transform. Raises ``ValueError`` where it has none."""
    if pair.target_from_source is None:
        raise ValueError(f"the pair {pair.target}, {pair.source} has no transform")
    target, source = grounds[indices[0]], grounds[indices[1]]
    local = target.metres_from_local.inverse() @ pair.target_from_source @ source.metres_from_local
    smaller = min(target.diagonal, local.scale * source.diagonal)
    floor = np.diag([FLOOR_SHARE * smaller, FLOOR_SHARE * smaller, FLOOR_TURN, FLOOR_GROWTH]) ** 2
    covariance = floor.copy()
    if pair.covariance is not None:
        covariance += _local(pair.target_from_source, pair.covariance, target, source)
    ceiling = CEILING_SHARE * smaller
    widest = float(np.linalg.eigvalsh(covariance[:2, :2]).max())
    covariance *= min(1.0, ceiling**2 / widest)
    return Edge(*indices, local, covariance, max(LEAST_WEIGHT, log_odds(pair.confidence)))


def log_odds(confidence: float, most: float = 3.0) -> float:
    """Of a confidence; no answer is so sure that others cannot outweigh it."""
    bounded = min(max(confidence, 1e-9), 1.0 - 1e-9)
    return min(most, max(-most, math.log(bounded / (1.0 - bounded))))


def _local(
    metric: Similarity2, parameters: NDArray[np.float64], target: LocalFrame, source: LocalFrame
) -> NDArray[np.float64]:
    """The covariance of x, y, yaw and scale in metres as that of a move about the source's middle in local cells."""
    in_logs = np.diag([1.0, 1.0, 1.0, 1.0 / metric.scale])
    middle = metric.apply(np.array([source.metres_from_local.x, source.metres_from_local.y]))
    moved = Similarity2(*(np.array([metric.x, metric.y]) - middle)).adjoint() @ in_logs
    local_from_metres = target.metres_from_local.inverse()
    whole = Similarity2(yaw=local_from_metres.yaw, scale=local_from_metres.scale).adjoint() @ moved
    return np.asarray(whole @ parameters @ whole.T)
