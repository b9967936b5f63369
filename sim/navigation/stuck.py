"""Detect robots that do not move although they should."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

STUCK_TIME, STUCK_DISTANCE, STUCK_TURN = 3.0, 0.15, 0.5
"""A robot is stuck if it moved less than this distance [m] and turned less than this angle [rad] in this time [s]."""


class StuckDetector:
    """Compare the robot's recent poses."""

    def __init__(self) -> None:
        self._past: deque[tuple[float, NDArray[np.float64], float]] = deque()

    def reset(self) -> None:
        """Forget the recent poses, because the robot does not try to move now."""
        self._past.clear()

    def update(self, now: float, here: NDArray[np.float64], yaw: float) -> bool:
        """Add the pose at ``now`` [s]: position ``here`` (2,) and ``yaw`` [rad]. Returns whether the robot is stuck; if
        so, resets."""
        self._past.append((now, here, yaw))
        if now - self._past[0][0] < STUCK_TIME:
            return False
        while now - self._past[0][0] > STUCK_TIME:
            self._past.popleft()
        stuck = all(
            math.dist(here, place) < STUCK_DISTANCE and abs(math.remainder(yaw - turned, math.tau)) < STUCK_TURN
            for _, place, turned in self._past
        )
        if stuck:
            self.reset()
        return stuck
