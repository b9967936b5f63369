"""Whether a robot that should get on does."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

STUCK_TIME, STUCK_DISTANCE, STUCK_TURN = 3.0, 0.15, 0.5
"""A robot that got no farther than this [m] and turned no more than this [rad] in this time [s] is stuck."""


class StuckWatch:
    """Remembers where a robot has been lately."""

    def __init__(self) -> None:
        self._past: deque[tuple[float, NDArray[np.float64], float]] = deque()

    def forget(self) -> None:
        """The robot has no wish to move now: begin anew."""
        self._past.clear()

    def notes(self, now: float, here: NDArray[np.float64], yaw: float) -> bool:
        """Whether a robot that is ``here``, (2,), and looks along ``yaw`` has been stuck up to ``now`` [s]; if so,
        begin anew."""
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
            self.forget()
        return stuck
