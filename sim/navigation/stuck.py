"""Detect robots that do not move although they should."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from sim.navigation.settings import StuckSettings


class StuckDetector:
    """Compare the robot's recent poses."""

    def __init__(self, settings: StuckSettings = StuckSettings()) -> None:
        self._settings = settings
        self._past: deque[tuple[float, NDArray[np.float64], float]] = deque()

    def reset(self) -> None:
        """Forget the recent poses, because the robot does not try to move now."""
        self._past.clear()

    def update(self, now: float, here: NDArray[np.float64], yaw: float) -> bool:
        """Add the pose at ``now`` [s]: position ``here`` (2,) and ``yaw`` [rad]. Returns whether the robot is stuck; if
        so, resets."""
        self._past.append((now, here, yaw))
        if now - self._past[0][0] < self._settings.time:
            return False
        while now - self._past[0][0] > self._settings.time:
            self._past.popleft()
        stuck = all(
            math.dist(here, place) < self._settings.distance
            and abs(math.remainder(yaw - turned, math.tau)) < self._settings.turn
            for _, place, turned in self._past
        )
        if stuck:
            self.reset()
        return stuck
