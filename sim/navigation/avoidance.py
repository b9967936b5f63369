"""Steering towards a point without touching what the lidar sees now."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.navigation.steering import COMFORT, HORIZON, MARGIN, best_motion, rooms_and_ends, straight_gaps
from sim.physics.drive import DriveLimits

MAX_SEEN = 120
"""More seen points near the robot than this tell nothing new."""


class Avoidance:
    """The dynamic window approach over a fixed fan of motions (forward speed, turn rate).

    Each is rolled out over a short horizon from how the robot moves now, as fast as it can speed up; those that come
    too near to a seen point fall out, and the one that ends best wins (Fox, Burgard and Thrun, "The dynamic window
    approach to collision avoidance", IEEE RAM 1997). ``radius`` [m] is the robot's.
    """

    def __init__(self, limits: DriveLimits, radius: float) -> None:
        self._radius = radius
        self._acceleration = (limits.acceleration, limits.turn_acceleration)
        speeds = limits.speed * np.array((-0.25, 0.0, 0.3, 0.65, 1.0))
        turns = limits.turn_rate * np.linspace(-1.0, 1.0, 11)
        self._fan = np.stack(np.meshgrid(speeds, turns, indexing="ij"), axis=-1).reshape(-1, 2)
        self._reach = limits.speed * HORIZON + radius + COMFORT

    def steer(
        self,
        target: NDArray[np.float64],
        seen: NDArray[np.float64],
        velocity: tuple[float, float] = (0.0, 0.0),
        drifts: NDArray[np.float64] | None = None,
    ) -> tuple[float, float]:
        """(forward speed [m/s], turn rate [rad/s]) towards a target, (2,), past seen points, (N, 2), in base [m], for
        a robot that moves at ``velocity`` (the same two) now. ``drifts``, (N, 2) [m/s], is how the points move.

        Where every motion comes too near, the one that keeps or wins the most room.
        """
        drifts = np.zeros_like(seen) if drifts is None else drifts
        chosen = self._near(seen, HORIZON * np.hypot(drifts[:, 0], drifts[:, 1]))
        rooms, ends = rooms_and_ends(
            self._fan, velocity, self._acceleration, self._radius, seen[chosen], drifts[chosen]
        )
        speed, turn_rate = self._fan[best_motion(self._fan, rooms, ends, np.ascontiguousarray(target))]
        return float(speed), float(turn_rate)

    def aim(self, path: NDArray[np.float64], seen: NDArray[np.float64]) -> NDArray[np.float64]:
        """The last point of a path, (M, 2), that the robot could reach straight past seen points, all in base [m].

        Where it could reach none, the path's first point.
        """
        gaps = straight_gaps(np.ascontiguousarray(path), seen[self._near(seen, 0.0)])
        straight = np.flatnonzero(gaps >= min(self._radius + MARGIN, gaps[0]))
        point: NDArray[np.float64] = path[int(straight[-1])]
        return point

    def _near(self, seen: NDArray[np.float64], coming: NDArray[np.float64] | float) -> NDArray[np.int64]:
        """Which of the seen points a motion can come near to that may come nearer by so much [m], thinned out to at
        most ``MAX_SEEN`` of them."""
        near = np.flatnonzero(seen[:, 0] ** 2 + seen[:, 1] ** 2 < (self._reach + coming) ** 2)
        return near[:: 1 + len(near) // MAX_SEEN]
