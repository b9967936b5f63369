"""Estimate the velocity of the nearest moving object."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.navigation.settings import TrackingSettings


class Tracker:
    """Track the nearest moving object from scan to scan."""

    def __init__(self, settings: TrackingSettings = TrackingSettings()) -> None:
        self._settings = settings
        self._stamp, self._middle = -math.inf, np.zeros(2)
        self._velocity = np.zeros(2)

    def passes(self, here: NDArray[np.float64]) -> bool:
        """Return whether the nearest object moves, and not just towards the robot at ``here`` (2,)."""
        speed = float(np.hypot(*self._velocity))
        towards = (here - self._middle) / max(float(np.hypot(*(here - self._middle))), 1e-6)
        return speed > self._settings.passing_speed and float(self._velocity @ towards) < 0.7 * speed

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
        same = np.hypot(*(points - nearest).T) < self._settings.size
        middle = points[same].mean(axis=0)
        seconds = now - self._stamp
        moved = middle - self._middle
        if 0.0 < seconds < 1.0 and np.hypot(*moved) < self._settings.fastest * seconds:
            weight = self._settings.newest_weight
            self._velocity = (1.0 - weight) * self._velocity + weight * moved / seconds
        else:
            self._velocity = np.zeros(2)
        self._stamp, self._middle = now, middle
        drifts[same] = self._velocity
        return drifts
