"""Compute with solid polygons: (N, 2) rows of x, y [m], counter-clockwise, closed, simple."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapping.arrays import frozen_array

Polygon = NDArray[np.float64]


def box(x0: float, y0: float, x1: float, y1: float) -> Polygon:
    """Return the axis-aligned rectangle between two opposite corners [m], (4, 2)."""
    (left, right), (low, high) = sorted((x0, x1)), sorted((y0, y1))
    return frozen_array([(left, low), (right, low), (right, high), (left, high)], np.float64)


def turned_box(x: float, y: float, length: float, width: float, yaw: float) -> Polygon:
    """Return the rectangle of ``length`` along ``yaw`` and ``width`` across, centred on (x, y) [m, rad], (4, 2)."""
    half = np.array([(-length, -width), (length, -width), (length, width), (-length, width)]) / 2.0
    c, s = math.cos(yaw), math.sin(yaw)
    return frozen_array(half @ np.array([(c, s), (-s, c)]) + (x, y), np.float64)


def disc(x: float, y: float, radius: float, corners: int = 16) -> Polygon:
    """Return a regular polygon with ``corners`` corners on a circle of ``radius`` about (x, y) [m], (corners, 2)."""
    angles = math.tau * np.arange(corners) / corners
    return frozen_array(np.stack((x + radius * np.cos(angles), y + radius * np.sin(angles)), axis=-1), np.float64)


def edges(polygon: Polygon) -> NDArray[np.float64]:
    """Return the edges (N, 2, 2): start and end [m] of each, the last one closing the polygon."""
    return np.stack((polygon, np.concatenate((polygon[1:], polygon[:1]))), axis=1)


def signed_area(polygon: Polygon) -> float:
    """Compute the area [m^2], positive if the corners run counter-clockwise."""
    x, y = polygon.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2.0)


def contains(polygon: Polygon, points: ArrayLike) -> NDArray[np.bool_]:
    """Return which of the points (N, 2) [m] lie inside, by the parity of edge crossings: (N,)."""
    x, y = np.asarray(points, dtype=np.float64).T[..., None]
    start, end = edges(polygon).transpose(1, 2, 0)
    spans = (start[1] <= y) != (end[1] <= y)
    rise = np.where(start[1] == end[1], 1.0, end[1] - start[1])
    crossing_x = start[0] + (y - start[1]) * (end[0] - start[0]) / rise
    inside: NDArray[np.bool_] = (np.count_nonzero(spans & (x < crossing_x), axis=1) % 2) == 1
    return inside


def is_simple(polygon: Polygon) -> bool:
    """Return True if no two edges cross or touch, except at the common corners of neighbours."""
    count = len(polygon)
    start, end = edges(polygon).transpose(1, 0, 2)
    side_of_start = _turn(start[:, None], end[:, None], start[None])
    side_of_end = _turn(start[:, None], end[:, None], end[None])
    parts = side_of_start * side_of_end <= 0.0
    crosses = parts & parts.T
    gap = (np.arange(count)[:, None] - np.arange(count)[None]) % count
    apart = (gap > 1) & (gap < count - 1)
    collinear = (side_of_start == 0.0) & (side_of_end == 0.0)
    overlap = (np.minimum(start, end)[:, None] <= np.maximum(start, end)[None]).all(axis=2)
    crosses &= ~collinear | (overlap & overlap.T)
    return not bool((crosses & apart).any()) and bool((start != end).any(axis=1).all())


def distances(segments: NDArray[np.float64], points: ArrayLike) -> NDArray[np.float64]:
    """Return the distance from each point (N, 2) to the nearest segment (M, 2, 2) [m]: (N,)."""
    rows = np.asarray(points, dtype=np.float64)
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    length_squared = np.maximum((along**2).sum(axis=1), np.finfo(np.float64).tiny)
    nearest = np.empty(len(rows))
    chunk = max(1, 2_000_000 // max(1, len(segments)))
    for first in range(0, len(rows), chunk):
        offset = rows[first : first + chunk, None] - start
        share = np.clip((offset * along).sum(axis=2) / length_squared, 0.0, 1.0)
        gap = offset - share[..., None] * along
        nearest[first : first + chunk] = np.hypot(gap[..., 0], gap[..., 1]).min(axis=1)
    return nearest


def _turn(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    turn: NDArray[np.float64] = np.sign(
        (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])
    )
    return turn
