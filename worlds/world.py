"""Define the world that robots explore."""

from __future__ import annotations

import math
from dataclasses import dataclass
from hashlib import sha256

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapping.arrays import frozen_array
from mapping.geometry.se2 import SE2
from worlds.polygon import Polygon, contains, distances, edges, is_simple, signed_area

LARGEST_SIDE = 10_000.0
"""Longest side of a world [m]."""

MAX_OBSTACLES = 50_000
"""Most obstacles of a world: PyBullet loads so many in half a minute."""

MAX_CORNERS = 3_000
"""Most corners of one polygon: each edge is compared with each other one, in half a gigabyte."""

MAX_COMPARED = 50_000_000
"""Most pairs of edges that are compared in all polygons of a world: ten seconds."""


@dataclass(frozen=True, eq=False)
class World:
    """Describe a rectangle [0, width] x [0, height] of free space with solid ``obstacles``.

    ``size`` is (width, height) in metres. Each obstacle is a polygon, (N, 2) rows of x, y [m], counter-clockwise,
    closed and simple. Outer walls are obstacles too, and obstacles may overlap. ``seed`` generated the world of that
    ``name``.

    ``starts`` are world_from_base of robots that may start here; starts less than 1 m apart are alternatives. Robots
    stay inside the ``fence``, a polygon that no lidar sees. ``parts`` is the number of separate parts of the free
    floor.

    Raises ``ValueError`` if a size is not positive, or a polygon is clockwise, crosses itself, has fewer than three
    corners or leaves the rectangle.
    """

    name: str
    seed: int
    size: tuple[float, float]
    obstacles: tuple[Polygon, ...]
    starts: tuple[SE2, ...] = ()
    fence: Polygon | None = None
    parts: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", (float(self.size[0]), float(self.size[1])))
        object.__setattr__(self, "obstacles", tuple(frozen_array(each, np.float64) for each in self.obstacles))
        object.__setattr__(self, "starts", tuple(self.starts))
        for name, value in zip(("width", "height"), self.size, strict=True):
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"World: {name} is {value}, must be positive and finite")
        self._check_extent()
        for index, polygon in enumerate(self.obstacles):
            fault = _fault(polygon, self.size)
            if fault:
                raise ValueError(f"World {self.name!r}: obstacle {index} {fault}")
        if self.fence is not None:
            object.__setattr__(self, "fence", frozen_array(self.fence, np.float64))
            fault = _fault(self.fence, self.size)
            if fault:
                raise ValueError(f"World {self.name!r}: fence {fault}")
        if self.parts < 1:
            raise ValueError(f"World {self.name!r}: parts is {self.parts}, must be at least 1")

    def _check_extent(self) -> None:
        """Bound the work that a world makes, before its polygons are compared edge by edge."""
        if max(self.size) > LARGEST_SIDE:
            width, height = self.size
            raise ValueError(f"World: size is {width:g} x {height:g} m, must be at most {LARGEST_SIDE:g} m a side")
        if len(self.obstacles) > MAX_OBSTACLES:
            raise ValueError(f"World: has {len(self.obstacles)} obstacles, must have at most {MAX_OBSTACLES}")
        for polygon in self._polygons():
            if len(polygon) > MAX_CORNERS:
                raise ValueError(f"World: a polygon has {len(polygon)} corners, must have at most {MAX_CORNERS}")
        compared = sum(len(polygon) ** 2 for polygon in self._polygons())
        if compared > MAX_COMPARED:
            raise ValueError(
                f"World: its polygons have {compared} pairs of edges, must have at most {MAX_COMPARED}; "
                "divide polygons of many corners"
            )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, World):
            return NotImplemented
        mine, theirs = (
            (each.name, each.seed, each.size, each.starts, each.parts, each.fence is None, len(each.obstacles))
            for each in (self, other)
        )
        return mine == theirs and all(
            np.array_equal(a, b) for a, b in zip(self._polygons(), other._polygons(), strict=True)
        )

    __hash__ = None  # type: ignore[assignment]

    def _polygons(self) -> tuple[Polygon, ...]:
        return self.obstacles if self.fence is None else (*self.obstacles, self.fence)

    @property
    def fingerprint(self) -> str:
        """Hash of the size, the obstacles and the fence: worlds that differ only in name, seed or starts share it."""
        content = sha256(repr((self.size, self.fence is None, [len(polygon) for polygon in self._polygons()])).encode())
        for polygon in self._polygons():
            content.update(polygon.tobytes())
        return content.hexdigest()

    @property
    def bounds(self) -> str:
        """Name the obstacle that bounds the robots' positions, for messages."""
        return "a wall" if self.fence is None else "a solid or the fence"

    def segments(self) -> NDArray[np.float64]:
        """Return the edges of all obstacles [m], (M, 2, 2)."""
        if not self.obstacles:
            return np.empty((0, 2, 2))
        return np.concatenate([edges(polygon) for polygon in self.obstacles])

    def clearance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the distance from each point (N, 2) to the nearest solid or the fence [m]: (N,).

        It is 0 inside a solid and outside the fence, and +inf in a world without either.
        """
        rows = np.asarray(points, dtype=np.float64)
        gap = np.full(len(rows), math.inf)
        for sides in (self.segments(), *([] if self.fence is None else [edges(self.fence)])):
            if len(sides):
                gap = np.minimum(gap, distances(sides, rows))
        gap[self._in_solid(rows)] = 0.0
        if self.fence is not None:
            gap[~contains(self.fence, rows)] = 0.0
        return gap

    def fault_at(self, x: float, y: float) -> str | None:
        """Explain why a robot cannot be at a point [m], in words that follow "is"; None if it can."""
        width, height = self.size
        if not (0.0 <= x <= width and 0.0 <= y <= height):
            return f"outside world {self.name!r} of {width:g} x {height:g} m"
        if self.fence is not None and not contains(self.fence, [(x, y)])[0]:
            return f"outside the fence of world {self.name!r}"
        if self.clearance([(x, y)])[0] <= 0.0:
            return f"in a wall of world {self.name!r}"
        return None

    def _in_solid(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        within = np.zeros(len(points), dtype=np.bool_)
        if not self.obstacles:
            return within
        first = np.cumsum([0, *(len(polygon) for polygon in self.obstacles[:-1])])
        corners = np.concatenate(self.obstacles)
        low, high = np.minimum.reduceat(corners, first), np.maximum.reduceat(corners, first)
        for index, point in enumerate(points):
            near = np.flatnonzero(((low <= point) & (point <= high)).all(axis=1))
            within[index] = any(contains(self.obstacles[each], point[None])[0] for each in near)
        return within


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
