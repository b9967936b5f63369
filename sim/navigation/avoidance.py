"""Steer towards a point without collision."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.navigation.settings import SteeringSettings
from sim.navigation.steering import best_motion, line_clearances, roll_out
from sim.physics.drive import DriveLimits


class Avoidance:
    """Steer by the dynamic window approach over a fixed set of motions (forward speed, turn rate).

    Each motion is simulated over a short horizon from the current velocity, within the acceleration limits. Motions
    that come too near to a seen point are discarded, and the best of the rest is chosen (Fox, Burgard and Thrun, "The
    dynamic window approach to collision avoidance", IEEE RAM 1997). ``radius`` [m] is the robot's.
    """

    def __init__(self, limits: DriveLimits, radius: float, settings: SteeringSettings = SteeringSettings()) -> None:
        self._radius, self._settings = radius, settings
        self._acceleration = (limits.acceleration, limits.turn_acceleration)
        speeds = limits.speed * np.array((-0.25, 0.0, 0.3, 0.65, 1.0))
        turns = limits.turn_rate * np.linspace(-1.0, 1.0, 11)
        self._fan = np.stack(np.meshgrid(speeds, turns, indexing="ij"), axis=-1).reshape(-1, 2)
        self._reach = limits.speed * settings.horizon + radius + settings.comfort

    def steer(
        self,
        target: NDArray[np.float64],
        seen: NDArray[np.float64],
        velocity: tuple[float, float] = (0.0, 0.0),
        drifts: NDArray[np.float64] | None = None,
    ) -> tuple[float, float]:
        """Return (forward speed [m/s], turn rate [rad/s]) towards a ``target`` (2,) past ``seen`` points (N, 2), in
        base [m].

        ``velocity`` is the robot's present (forward speed, turn rate); ``drifts`` (N, 2) [m/s] are the velocities of
        the points. If every motion comes too near, the one that keeps or gains the most clearance is chosen.
        """
        drifts, settings = np.zeros_like(seen) if drifts is None else drifts, self._settings
        chosen = self._near(seen, settings.horizon * np.hypot(drifts[:, 0], drifts[:, 1]))
        rooms, ends = roll_out(
            fan=self._fan,
            velocity=velocity,
            acceleration=self._acceleration,
            radius=self._radius,
            near=seen[chosen],
            drifts=drifts[chosen],
            horizon=settings.horizon,
            steps=settings.steps,
        )
        best = best_motion(
            fan=self._fan,
            rooms=rooms,
            ends=ends,
            target=np.ascontiguousarray(target),
            margin=settings.hull_margin,
            comfort=settings.comfort,
        )
        speed, turn_rate = self._fan[best]
        return float(speed), float(turn_rate)

    def choose_target(self, path: NDArray[np.float64], seen: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the last point of a path (M, 2) with a free straight line to it past ``seen`` points, all in base [m].

        Returns the path's first point if there is none.
        """
        gaps = line_clearances(np.ascontiguousarray(path), seen[self._near(seen, 0.0)])
        straight = np.flatnonzero(gaps >= min(self._radius + self._settings.hull_margin, gaps[0]))
        point: NDArray[np.float64] = path[int(straight[-1])]
        return point

    def _near(self, seen: NDArray[np.float64], coming: NDArray[np.float64] | float) -> NDArray[np.int64]:
        """Return the indices of the points that a motion can come near to, at most about ``max_seen``.

        ``coming`` [m] is how far each point may approach within the horizon.
        """
        near = np.flatnonzero(seen[:, 0] ** 2 + seen[:, 1] ** 2 < (self._reach + coming) ** 2)
        return near[:: 1 + len(near) // self._settings.max_seen]
