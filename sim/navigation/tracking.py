"""Estimate the velocity of the nearest moving object."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

SIZE = 0.6
"""Points this near to the nearest one [m] count as the same robot."""
FASTEST = 2.0
"""An apparent motion faster than this [m/s] means that the nearest object has changed."""
GOING = 0.1
"""Least speed of an object that is passing [m/s]."""
TRUST = 0.5
"""Weight of the newest velocity estimate."""


class Tracker:
    """Track the nearest moving object from scan to scan."""

    def __init__(self) -> None:
        self._stamp, self._middle = -math.inf, np.zeros(2)
        self._velocity = np.zeros(2)

    def passes(self, here: NDArray[np.float64]) -> bool:
        """Return whether the nearest object moves, and not just towards the robot at ``here`` (2,)."""
        speed = float(np.hypot(*self._velocity))
        towards = (here - self._middle) / max(float(np.hypot(*(here - self._middle))), 1e-6)
        return speed > GOING and float(self._velocity @ towards) < 0.7 * speed

    def drifts(self, now: float, points: NDArray[np.float64], here: NDArray[np.float64]) -> NDArray[np.float64]:
        """Estimate the velocity (N, 2) [m/s] of moving ``points`` (N, 2) [m] in the map, at time ``now`` [s], for a
        robot at ``here`` (2,).

        Points of the nearest object get its velocity, all others 0.
        """
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
