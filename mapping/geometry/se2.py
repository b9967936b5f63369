"""Rigid motions of the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


def wrap_angle(angle: float) -> float:
    """The same angle [rad] in [-pi, pi]."""
    return math.remainder(angle, math.tau)


@dataclass(frozen=True)
class SE2:
    """A pose or rigid motion: ``p' = R(yaw) p + (x, y)``.

    ``x`` and ``y`` in metres, ``yaw`` in radians, counter-clockwise (REP 103), kept in [-pi, pi].
    Name an instance by both frames, so that products read like dominoes:
    ``world_from_lidar = world_from_base @ base_from_lidar``.

    Raises ``ValueError`` where a number is not finite.
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def __post_init__(self) -> None:
        for name in ("x", "y", "yaw"):
            value = float(getattr(self, name))
            if not math.isfinite(value):
                raise ValueError(f"SE2: {name} is {value}, not a finite number")
            object.__setattr__(self, name, value)
        object.__setattr__(self, "yaw", wrap_angle(self.yaw))

    @staticmethod
    def identity() -> SE2:
        return SE2()

    def inverse(self) -> SE2:
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return SE2(-c * self.x - s * self.y, s * self.x - c * self.y, -self.yaw)

    def __matmul__(self, other: SE2) -> SE2:
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return SE2(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            self.yaw + other.yaw,
        )

    def apply(self, points: ArrayLike) -> NDArray[np.float64]:
        """Move points, (N, 2) rows of x, y [m], to (N, 2)."""
        points = np.asarray(points, dtype=np.float64)
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        x, y = points[..., 0], points[..., 1]
        return np.stack((self.x + c * x - s * y, self.y + s * x + c * y), axis=-1)
