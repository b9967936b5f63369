"""How the nearest thing that moves is moving."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

SIZE = 0.6
"""Points this near to the nearest one [m] are taken for the same robot."""
FASTEST = 2.0
"""A thing that seems to move faster [m/s] is another one."""
GOING = 0.1
"""A thing that moves at least this fast [m/s] is going somewhere."""
TRUST = 0.5
"""Weight of the newest estimate."""


class Tracker:
    """Follows the nearest of the things that move from scan to scan."""

    def __init__(self) -> None:
        self._stamp, self._middle = -math.inf, np.zeros(2)
        self._velocity = np.zeros(2)

    def passes(self, here: NDArray[np.float64]) -> bool:
        """Whether the nearest thing moves, and not just nearer to a robot ``here``, (2,)."""
        speed = float(np.hypot(*self._velocity))
        towards = (here - self._middle) / max(float(np.hypot(*(here - self._middle))), 1e-6)
        return speed > GOING and float(self._velocity @ towards) < 0.7 * speed

    def drifts(self, now: float, points: NDArray[np.float64], here: NDArray[np.float64]) -> NDArray[np.float64]:
        """The velocity of each seen point that moves, (N, 2) each, [m] and [m/s] in the map, at time ``now`` [s] for a
        robot ``here``, (2,): that of the nearest thing, and 0 for all others."""
        drifts = np.zeros_like(points)
        if len(points) == 0:
            self._stamp, self._velocity = -math.inf, np.zeros(2)
            return drifts
        nearest = points[int(np.argmin(np.hypot(*(points - here).T)))]
        same = np.hypot(*(points - nearest).T) < SIZE
        middle = points[same].mean(axis=0)
        seconds = now - self._stamp
        moved = middle - self._middle
        if 0.0 < seconds < 1.0 and np.hypot(*moved) < FASTEST * seconds:
            self._velocity = (1.0 - TRUST) * self._velocity + TRUST * moved / seconds
        else:
            self._velocity = np.zeros(2)
        self._stamp, self._middle = now, middle
        drifts[same] = self._velocity
        return drifts
