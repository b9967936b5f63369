"""What answers are worth in triangles of answers, before any map is joined."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from mapping.geometry.similarity2 import Similarity2
from merge.multimap.cluster import agrees
from merge.multimap.edge import Edge

Place = Callable[[int, int, Similarity2], float]
"""The log-odds, from the cells, that the source lies at a place on the target (``OverlapLikelihood``)."""

IN_TRIANGLE, AGAINST_TRIANGLE = 2.0, -2.0
"""Log-odds that an answer gains in a triangle of answers that agree, and loses in one that does not, where the two
others are right (after Zach et al. 2010)."""

TURNS = 6

SUREST, UNSUREST = 8.0, -4.0


def weighted(edges: Sequence[Edge], place: Place, fixed_scale: bool) -> list[Edge]:
    """The edges, by whose weights groups are joined: their own cells, and the triangles that they are in, are heard.

    A triangle says as much of an edge as its two others are believed, which is found by turns.
    """
    between = {(e.target, e.source): (k, e) for k, edge in enumerate(edges) for e in (edge, edge.reversed())}
    beside: dict[int, set[int]] = {}
    for target, source in between:
        beside.setdefault(target, set()).add(source)
    alone = np.array([e.weight + min(0.0, place(e.target, e.source, e.target_from_source)) for e in edges])
    triangles: list[tuple[int, int, int, float]] = []
    for k, edge in enumerate(edges):
        for third in sorted(beside[edge.target] & beside[edge.source]):
            (i, there), (j, back) = between[edge.target, third], between[third, edge.source]
            through = there.target_from_source @ back.target_from_source
            closes = agrees(edge, through, fixed_scale, _chained(there, back))
            triangles.append((k, i, j, IN_TRIANGLE if closes else AGAINST_TRIANGLE))
    weights = alone
    for _ in range(TURNS if triangles else 0):
        believed = expit(weights)
        told = alone.copy()
        for k, i, j, says in triangles:
            told[k] += says * believed[i] * believed[j]
        weights = (weights + np.clip(told, UNSUREST, SUREST)) / 2.0
    return [dataclasses.replace(e, weight=float(w)) for e, w in zip(edges, weights, strict=True)]


def _chained(there: Edge, back: Edge) -> NDArray[np.float64]:
    """The covariance of the product of two edges, as a move about the middle of the last map."""
    first, second = there.target_from_source, back.target_from_source
    turned = Similarity2(yaw=first.yaw, scale=first.scale)
    arm = turned.apply([second.x, second.y])
    by_first, by_second = Similarity2(*-arm).adjoint(), turned.adjoint()
    return np.asarray(by_first @ there.covariance @ by_first.T + by_second @ back.covariance @ by_second.T)
