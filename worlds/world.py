"""A place to explore."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapping.arrays import frozen_array
from worlds.polygon import Polygon, contains, distances, edges, is_simple, signed_area


@dataclass(frozen=True, eq=False)
class World:
    """A rectangle [0, width] x [0, height] of free space with solid ``obstacles`` in it.

    ``size`` is (width, height) in metres; each obstacle a polygon, (N, 2) rows of x, y [m], counter-clockwise,
    closed and simple; outer walls are obstacles like all others, and obstacles may overlap. ``seed`` is what the
    world of that ``name`` was drawn from.

    Raises ``ValueError`` where a size is not positive, or a polygon is clockwise, crosses itself, has fewer than
    three corners or leaves the rectangle.
    """

    name: str
    seed: int
    size: tuple[float, float]
    obstacles: tuple[Polygon, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", (float(self.size[0]), float(self.size[1])))
        object.__setattr__(self, "obstacles", tuple(frozen_array(each, np.float64) for each in self.obstacles))
        for name, value in zip(("width", "height"), self.size, strict=True):
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"World: {name} is {value}, must be positive and finite")
        for index, polygon in enumerate(self.obstacles):
            fault = _fault(polygon, self.size)
            if fault:
                raise ValueError(f"World {self.name!r}: obstacle {index} {fault}")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, World):
            return NotImplemented
        mine, theirs = (self.name, self.seed, self.size), (other.name, other.seed, other.size)
        return (
            mine == theirs
            and len(self.obstacles) == len(other.obstacles)
            and all(np.array_equal(a, b) for a, b in zip(self.obstacles, other.obstacles, strict=True))
        )

    __hash__ = None  # type: ignore[assignment]

    def segments(self) -> NDArray[np.float64]:
        """The sides of all obstacles [m], (M, 2, 2)."""
        if not self.obstacles:
            return np.empty((0, 2, 2))
        return np.concatenate([edges(polygon) for polygon in self.obstacles])

    def clearance(self, points: ArrayLike) -> NDArray[np.float64]:
        """From each point, (N, 2), to the nearest solid [m]: (N,); 0 inside one, +inf in a world without any."""
        rows = np.asarray(points, dtype=np.float64)
        if not self.obstacles:
            return np.full(len(rows), math.inf)
        gap = distances(self.segments(), rows)
        for polygon in self.obstacles:
            within = ((rows >= polygon.min(axis=0)) & (rows <= polygon.max(axis=0))).all(axis=1)
            gap[np.flatnonzero(within)[contains(polygon, rows[within])]] = 0.0
        return gap


def _fault(polygon: Polygon, size: tuple[float, float]) -> str | None:
    if polygon.ndim != 2 or polygon.shape[1] != 2 or len(polygon) < 3:
        return f"has shape {polygon.shape}, needs (N, 2) with at least three corners"
    if not np.isfinite(polygon).all():
        return "holds a number that is not finite"
    if (polygon < -1e-9).any() or (polygon > np.array(size) + 1e-9).any():
        return f"leaves the world's {size[0]} x {size[1]} m"
    if signed_area(polygon) <= 0.0:
        return "does not run counter-clockwise"
    if not is_simple(polygon):
        return "crosses or touches itself"
    return None
