"""Similarities of the plane, Sim(2): rigid motions with a scale, with their tangent space.

A tangent vector of Sim(2) is (x, y, yaw, log scale); perturbations act from the left, as in SE(2). In complex numbers a
similarity is ``p' = a p + t`` with ``a = scale exp(i yaw)``, a tangent vector is ``(u, w) = (x + i y, log scale +
i yaw)``, and

    exp(u, w) = (exp(w), u (exp(w) - 1) / w),    Ad(a, t) (u, w) = (a u - w t, w).

Source: Eade 2017, "Lie groups for 2D and 3D transformations", section 6, for Sim(3); Sola et al. 2018 for the notation.

Covariances of poses use another, simpler chart: ``plus`` and ``minus`` change x, y, yaw and log scale each by itself.
To first order that is a perturbation about the image of the source's origin.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapping.geometry.se2 import SE2, mean_rotation, wrap_angle


@dataclass(frozen=True)
class Similarity2:
    """A similarity ``p' = scale R(yaw) p + (x, y)`` with ``scale > 0``.

    ``x`` and ``y`` are metres of the frame on the left, ``yaw`` radians counter-clockwise in [-pi, pi],
    ``scale`` metres of the left frame per metre of the right one.

    Raises ``ValueError`` if a number is not finite or the scale is not positive.
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
    def exp(tangent: ArrayLike) -> Similarity2:
        """Move with a constant velocity (4,), x, y [m], yaw [rad] and log scale, for one unit of time."""
        x, y, yaw, log_scale = np.asarray(tangent, dtype=np.float64).tolist()
        shift = mean_rotation(complex(log_scale, yaw)) * complex(x, y)
        return Similarity2(shift.real, shift.imag, yaw, math.exp(log_scale))

    def log(self) -> NDArray[np.float64]:
        """Return the velocity (4,) that leads to this similarity, its yaw in [-pi, pi]."""
        log_scale = math.log(self.scale)
        velocity = complex(self.x, self.y) / mean_rotation(complex(log_scale, self.yaw))
        return np.array([velocity.real, velocity.imag, self.yaw, log_scale])

    def adjoint(self) -> NDArray[np.float64]:
        """Return the matrix (4, 4) with ``self @ exp(v) == exp(self.adjoint() @ v) @ self``."""
        c, s = self.scale * math.cos(self.yaw), self.scale * math.sin(self.yaw)
        return np.array(
            [[c, -s, self.y, -self.x], [s, c, -self.x, -self.y], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
        )

    def about(self, centre: ArrayLike) -> Similarity2:
        """Apply this similarity about ``centre`` (2,) instead of the origin: ``p' = centre + self(p - centre)``.

        Its tangent vector is ``Similarity2(*centre).adjoint() @ self.log()``.
        """
        centre = np.asarray(centre, dtype=np.float64)
        fixed = Similarity2(yaw=self.yaw, scale=self.scale).apply(centre)
        x, y = (centre + np.array([self.x, self.y]) - fixed).tolist()
        return Similarity2(x, y, self.yaw, self.scale)

    def plus(self, change: ArrayLike) -> Similarity2:
        """Change x, y, yaw and log scale (4,), each by itself."""
        x, y, yaw, log_scale = np.asarray(change, dtype=np.float64).tolist()
        return Similarity2(self.x + x, self.y + y, self.yaw + yaw, self.scale * math.exp(log_scale))

    def minus(self, other: Similarity2) -> NDArray[np.float64]:
        """Return the change (4,) of x, y, yaw and log scale that leads from the other to this one."""
        yaw, log_scale = wrap_angle(self.yaw - other.yaw), math.log(self.scale / other.scale)
        return np.array([self.x - other.x, self.y - other.y, yaw, log_scale])

    @staticmethod
    def from_matrix(matrix: ArrayLike) -> Similarity2:
        """Return the similarity nearest to a (2, 3) matrix ``[[a, -b, x], [b, a, y]]``."""
        m = np.asarray(matrix, dtype=np.float64)
        a, b = (m[0, 0] + m[1, 1]) / 2.0, (m[1, 0] - m[0, 1]) / 2.0
        return Similarity2(float(m[0, 2]), float(m[1, 2]), math.atan2(b, a), math.hypot(a, b))

    def matrix(self) -> NDArray[np.float64]:
        """Return the (2, 3) matrix that maps a column (x, y, 1)."""
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
