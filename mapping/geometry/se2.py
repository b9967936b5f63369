"""Rigid motions of the plane, SE(2), with their tangent space.

A tangent vector of SE(2) is (x, y, yaw): a constant velocity [m, m, rad per unit of time] in the frame on the left.
Perturbations act from the left, ``exp(v) @ T``: they move what ``T`` has placed. Source: Sola, Deray and Atchuthan
2018, "A micro Lie theory for state estimation in robotics", appendix "SE(2)", equations 152 to 160.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


def wrap_angle(angle: float) -> float:
    """Wrap an angle [rad] to [-pi, pi]."""
    return math.remainder(angle, math.tau)


def mean_rotation(rate: complex) -> complex:
    """Average ``exp(rate t)`` over t from 0 to 1: ``(exp(rate) - 1) / rate``, which is 1 at a rate of 0.

    In complex numbers this is the matrix V of Sola et al. 2018, equation 158, for a rate of ``i yaw``; a similarity
    has the rate ``log scale + i yaw``. Below 1e-8 the first two terms of its series are exact.
    """
    return complex(np.expm1(rate) / rate) if abs(rate) > 1e-8 else 1.0 + rate / 2.0


@dataclass(frozen=True)
class SE2:
    """A pose or rigid motion: ``p' = R(yaw) p + (x, y)``.

    ``x`` and ``y`` in metres, ``yaw`` in radians, counter-clockwise (REP 103), in [-pi, pi]. Name an instance by both
    frames: ``world_from_lidar = world_from_base @ base_from_lidar``.

    Raises ``ValueError`` if a number is not finite.
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

    @staticmethod
    def exp(tangent: ArrayLike) -> SE2:
        """Move with a constant velocity (3,), x, y [m] and yaw [rad], for one unit of time (Sola et al., eq. 156)."""
        x, y, yaw = np.asarray(tangent, dtype=np.float64).tolist()
        shift = mean_rotation(1j * yaw) * complex(x, y)
        return SE2(shift.real, shift.imag, yaw)

    def log(self) -> NDArray[np.float64]:
        """Return the velocity (3,) that leads to this motion, its yaw in [-pi, pi] (Sola et al., eq. 157)."""
        velocity = complex(self.x, self.y) / mean_rotation(1j * self.yaw)
        return np.array([velocity.real, velocity.imag, self.yaw])

    def adjoint(self) -> NDArray[np.float64]:
        """Return the matrix (3, 3) with ``self @ exp(v) == exp(self.adjoint() @ v) @ self`` (Sola et al., eq. 159)."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[c, -s, self.y], [s, c, -self.x], [0.0, 0.0, 1.0]])

    def about(self, centre: ArrayLike) -> SE2:
        """Apply this motion about ``centre`` (2,) instead of the origin: ``p' = centre + self(p - centre)``."""
        centre = np.asarray(centre, dtype=np.float64)
        x, y = (centre + np.array([self.x, self.y]) - SE2(yaw=self.yaw).apply(centre)).tolist()
        return SE2(x, y, self.yaw)

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
