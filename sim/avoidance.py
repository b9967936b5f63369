"""Steering towards a point without touching what the lidar sees now."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.drive import DriveLimits

HORIZON = 1.2
"""How far ahead a motion is looked at [s]."""
MARGIN = 0.06
"""Least distance between the hull and anything seen [m]."""
COMFORT = 0.2
"""Distance of the hull to anything seen [m] below which a motion is thought worse."""

MAX_SEEN = 120
"""More seen points near the robot than this tell nothing new."""

_SAMPLES = 5


class Avoidance:
    """The dynamic window approach without the window, as a commanded velocity is reached at once.

    Every motion of a fixed fan (forward speed, turn rate) is rolled out over a short horizon; those that come too
    near to a seen point fall out, and the one that ends best wins (Fox, Burgard and Thrun, "The dynamic window
    approach to collision avoidance", IEEE RAM 1997). ``radius`` [m] is the robot's.
    """

    def __init__(self, limits: DriveLimits, radius: float) -> None:
        self._radius = radius
        speeds = limits.speed * np.array((-0.25, 0.0, 0.3, 0.65, 1.0))
        turns = limits.turn_rate * np.linspace(-1.0, 1.0, 11)
        self._fan = np.stack(np.meshgrid(speeds, turns, indexing="ij"), axis=-1).reshape(-1, 2)
        times = HORIZON * np.arange(1, _SAMPLES + 1) / _SAMPLES
        self._ways, self._headings = _rollouts(self._fan, times)
        self._ways_squared = (self._ways.reshape(-1, 2) ** 2).sum(axis=1)
        self._reach = limits.speed * HORIZON + radius + COMFORT

    def steer(self, target: NDArray[np.float64], seen: NDArray[np.float64]) -> tuple[float, float]:
        """(forward speed [m/s], turn rate [rad/s]) towards a target, (2,), past seen points, (N, 2), in base [m].

        Where every motion comes too near, the one that keeps or wins the most room.
        """
        room = self._room(seen)
        safe = room.min(axis=1) >= MARGIN
        if not safe.any():
            return _command(self._fan[int(np.argmax(room[:, -1] + room.min(axis=1)))])
        to_target = target - self._ways[:, -1]
        distance = np.hypot(to_target[:, 0], to_target[:, 1])
        bearing = np.arctan2(to_target[:, 1], to_target[:, 0]) - self._headings
        off = np.abs(np.arctan2(np.sin(bearing), np.cos(bearing))) * np.minimum(1.0, distance / 0.3)
        tight = np.maximum(0.0, COMFORT - room.min(axis=1)) / COMFORT
        backwards = self._fan[:, 0] < 0.0
        standing = (self._fan == 0.0).all(axis=1)
        cost = distance + 0.25 * off + 0.15 * tight + 0.2 * backwards + 0.3 * standing
        return _command(self._fan[int(np.argmin(np.where(safe, cost, math.inf)))])

    def aim(self, path: NDArray[np.float64], seen: NDArray[np.float64]) -> NDArray[np.float64]:
        """The last point of a path, (M, 2), that the robot could reach straight past seen points, all in base [m].

        Where it could reach none, the path's first point.
        """
        near = self._near(seen)
        if len(near) == 0:
            return _point(path, -1)
        length = np.maximum(np.hypot(path[:, 0], path[:, 1]), 1e-9)
        direction = path / length[:, None]
        along = np.clip(direction @ near.T, 0.0, length[:, None])
        gap = np.hypot(*(near - along[..., None] * direction[:, None]).transpose(2, 0, 1)).min(axis=1)
        straight = np.flatnonzero(gap >= min(self._radius + MARGIN, gap[0]))
        return _point(path, int(straight[-1]))

    def _room(self, seen: NDArray[np.float64]) -> NDArray[np.float64]:
        """From the hull to the nearest seen point [m] at each sample of each motion, (motions, samples)."""
        near = self._near(seen)
        if len(near) == 0:
            return np.full(self._ways.shape[:2], math.inf)
        ways = self._ways.reshape(-1, 2)
        near_squared = near[:, 0] ** 2 + near[:, 1] ** 2
        squared = self._ways_squared + (near_squared[:, None] - 2.0 * near @ ways.T).min(axis=0)
        room: NDArray[np.float64] = np.sqrt(np.maximum(squared, 0.0)) - self._radius
        return room.reshape(self._ways.shape[:2])

    def _near(self, seen: NDArray[np.float64]) -> NDArray[np.float64]:
        """The seen points that a motion can come near to, thinned out to at most ``MAX_SEEN`` of them."""
        near = seen[seen[:, 0] ** 2 + seen[:, 1] ** 2 < self._reach**2]
        return near[:: 1 + len(near) // MAX_SEEN]


def _point(path: NDArray[np.float64], index: int) -> NDArray[np.float64]:
    point: NDArray[np.float64] = path[index]
    return point


def _command(motion: NDArray[np.float64]) -> tuple[float, float]:
    return float(motion[0]), float(motion[1])


def _rollouts(fan: NDArray[np.float64], times: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions, (motions, samples, 2), along the arcs in base, and the headings where they end, (motions,)."""
    speed, turn = fan[:, :1], fan[:, 1:]
    angle = turn * times
    half = angle / 2.0
    chord = speed * times * np.sinc(half / np.pi)
    return np.stack((chord * np.cos(half), chord * np.sin(half)), axis=-1), angle[:, -1]
