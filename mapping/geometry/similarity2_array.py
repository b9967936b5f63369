"""Many similarities at once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2

Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Similarity2Array:
    """Similarities p' = turn p + shift of the plane of complex numbers, in arrays of any shape; they broadcast."""

    turn: Complex
    shift: Complex

    @staticmethod
    def of(motions: Iterable[Similarity2]) -> Similarity2Array:
        """Those (N,)."""
        rows = np.array([(m.x, m.y, m.yaw, m.scale) for m in motions], np.float64).reshape(-1, 4)
        return Similarity2Array(rows[:, 3] * np.exp(1j * rows[:, 2]), rows[:, 0] + 1j * rows[:, 1])

    def __getitem__(self, index: object) -> Similarity2Array:
        return Similarity2Array(self.turn[index], self.shift[index])  # type: ignore[call-overload]

    def __matmul__(self, other: Similarity2Array) -> Similarity2Array:
        return Similarity2Array(self.turn * other.turn, self.turn * other.shift + self.shift)

    def inverse(self) -> Similarity2Array:
        return Similarity2Array(1.0 / self.turn, -self.shift / self.turn)

    def minus(self, other: Similarity2Array) -> NDArray[np.float64]:
        """The moves (..., 4) that take the others to these: shift x, y, turn [rad] and growth [log scale]."""
        shift, turn = self.shift - other.shift, self.turn / other.turn
        return np.stack((shift.real, shift.imag, np.angle(turn), np.log(np.abs(turn))), axis=-1)


def rotations(turn: Complex) -> NDArray[np.float64]:
    """The matrices (..., 2, 2) that multiply as those complex numbers do."""
    return np.stack((turn.real, -turn.imag, turn.imag, turn.real), axis=-1).reshape(*turn.shape, 2, 2)
