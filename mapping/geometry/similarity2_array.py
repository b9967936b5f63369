"""Batches of similarities, with the operations of ``Similarity2``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapping.geometry.similarity2 import Similarity2

Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Similarity2Array:
    """Similarities ``p' = turn p + shift`` in complex numbers, in arrays of any shape (...); operations broadcast."""

    turn: Complex
    shift: Complex

    @staticmethod
    def of(motions: Iterable[Similarity2]) -> Similarity2Array:
        """Stack similarities to a batch (N,)."""
        rows = np.array([(m.x, m.y, m.yaw, m.scale) for m in motions], np.float64).reshape(-1, 4)
        return Similarity2Array(rows[:, 3] * np.exp(1j * rows[:, 2]), rows[:, 0] + 1j * rows[:, 1])

    def similarities(self) -> list[Similarity2]:
        """List the similarities of a batch (N,)."""
        yaws, scales = np.angle(self.turn).tolist(), np.abs(self.turn).tolist()
        places = zip(self.shift.real.tolist(), self.shift.imag.tolist(), yaws, scales, strict=True)
        return [Similarity2(x, y, yaw, scale) for x, y, yaw, scale in places]

    def __getitem__(self, index: object) -> Similarity2Array:
        return Similarity2Array(self.turn[index], self.shift[index])  # type: ignore[call-overload]

    def __matmul__(self, other: Similarity2Array) -> Similarity2Array:
        return Similarity2Array(self.turn * other.turn, self.turn * other.shift + self.shift)

    def inverse(self) -> Similarity2Array:
        return Similarity2Array(1.0 / self.turn, -self.shift / self.turn)

    @staticmethod
    def exp(tangents: ArrayLike) -> Similarity2Array:
        """Return the similarities (...) of tangent vectors (..., 4): x, y, yaw, log scale."""
        x, y, yaw, log_scale = np.moveaxis(np.asarray(tangents, np.float64), -1, 0)
        rate = log_scale + 1j * yaw
        return Similarity2Array(np.exp(rate), _mean_rotations(rate) * (x + 1j * y))

    def log(self) -> NDArray[np.float64]:
        """Return the tangent vectors (..., 4), their yaw in [-pi, pi]."""
        yaw, log_scale = np.angle(self.turn), np.log(np.abs(self.turn))
        velocity = self.shift / _mean_rotations(log_scale + 1j * yaw)
        return np.stack((velocity.real, velocity.imag, yaw, log_scale), axis=-1)

    def adjoint(self) -> NDArray[np.float64]:
        """Return the matrices (..., 4, 4) with ``self @ exp(v) == exp(self.adjoint() @ v) @ self``."""
        turn, shift = np.broadcast_arrays(self.turn, self.shift)
        matrices = np.zeros((*turn.shape, 4, 4))
        matrices[..., :2, :2] = rotations(turn)
        matrices[..., 0, 2], matrices[..., 1, 2] = shift.imag, -shift.real
        matrices[..., 0, 3], matrices[..., 1, 3] = -shift.real, -shift.imag
        matrices[..., 2, 2] = matrices[..., 3, 3] = 1.0
        return matrices

    def about(self, centres: ArrayLike) -> Similarity2Array:
        """Apply these similarities about ``centres`` (..., 2) instead of the origin."""
        x, y = np.moveaxis(np.asarray(centres, np.float64), -1, 0)
        return Similarity2Array(self.turn, self.shift + (1.0 - self.turn) * (x + 1j * y))

    def minus(self, other: Similarity2Array) -> NDArray[np.float64]:
        """Return the changes (..., 4) of x, y, yaw [rad] and log scale that lead from the others to these."""
        shift, turn = self.shift - other.shift, self.turn / other.turn
        return np.stack((shift.real, shift.imag, np.angle(turn), np.log(np.abs(turn))), axis=-1)


def rotations(turn: Complex) -> NDArray[np.float64]:
    """Return the matrices (..., 2, 2) that multiply as these complex numbers do."""
    return np.stack((turn.real, -turn.imag, turn.imag, turn.real), axis=-1).reshape(*turn.shape, 2, 2)


def _mean_rotations(rate: Complex) -> Complex:
    """Apply ``mean_rotation`` to every rate."""
    small = np.abs(rate) <= 1e-8
    return np.where(small, 1.0 + rate / 2.0, np.expm1(rate) / np.where(small, 1.0, rate))
