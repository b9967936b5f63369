"""Similarities of the plane: rigid motions with a scale."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapping.geometry.se2 import SE2, wrap_angle


@dataclass(frozen=True)
class Similarity2:
    """A similarity ``p' = scale R(yaw) p + (x, y)`` with ``scale > 0``.

    ``x`` and ``y`` are metres of the frame on the left, ``yaw`` radians counter-clockwise in [-pi, pi],
    ``scale`` metres of the left frame per metre of the right one.

    Raises ``ValueError`` where a number is not finite or the scale is not positive.
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    scale: float = 1.0

    def __post_init__(self) -> None:
        for name in ("x", "y", "yaw", "scale"):
            value = float(getattr(self, name))
            if not math.isfinite(value):
                raise ValueError(f"Similarity2: {name} is {value}, not a finite number")
            object.__setattr__(self, name, value)
        if self.scale <= 0.0:
            raise ValueError(f"Similarity2: scale is {self.scale}, must be positive")
        object.__setattr__(self, "yaw", wrap_angle(self.yaw))

    @staticmethod
    def identity() -> Similarity2:
        return Similarity2()

    @staticmethod
    def from_se2(motion: SE2, scale: float = 1.0) -> Similarity2:
        return Similarity2(motion.x, motion.y, motion.yaw, scale)

    @staticmethod
    def from_matrix(matrix: ArrayLike) -> Similarity2:
        """The similarity nearest to a (2, 3) matrix ``[[a, -b, x], [b, a, y]]``."""
        m = np.asarray(matrix, dtype=np.float64)
        a, b = (m[0, 0] + m[1, 1]) / 2.0, (m[1, 0] - m[0, 1]) / 2.0
        return Similarity2(float(m[0, 2]), float(m[1, 2]), math.atan2(b, a), math.hypot(a, b))

    def matrix(self) -> NDArray[np.float64]:
        """The (2, 3) matrix that maps a column (x, y, 1)."""
        c, s = self.scale * math.cos(self.yaw), self.scale * math.sin(self.yaw)
        return np.array([[c, -s, self.x], [s, c, self.y]])

    def inverse(self) -> Similarity2:
        c, s = math.cos(self.yaw) / self.scale, math.sin(self.yaw) / self.scale
        return Similarity2(-c * self.x - s * self.y, s * self.x - c * self.y, -self.yaw, 1.0 / self.scale)

    def __matmul__(self, other: Similarity2) -> Similarity2:
        c, s = self.scale * math.cos(self.yaw), self.scale * math.sin(self.yaw)
        return Similarity2(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            self.yaw + other.yaw,
            self.scale * other.scale,
        )

    def apply(self, points: ArrayLike) -> NDArray[np.float64]:
        """Move points, (N, 2) rows of x, y, to (N, 2)."""
        points = np.asarray(points, dtype=np.float64)
        c, s = self.scale * math.cos(self.yaw), self.scale * math.sin(self.yaw)
        x, y = points[..., 0], points[..., 1]
        return np.stack((self.x + c * x - s * y, self.y + s * x + c * y), axis=-1)
