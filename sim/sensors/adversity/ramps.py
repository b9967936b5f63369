"""Tilt the lidar on ramps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.seeds import Role, stream
from sim.sensors.adversity.free_floor import FreeFloor
from sim.sensors.adversity.settings import Adversity


@dataclass(frozen=True, eq=False)
class Ramps:
    """Hold the ``middles`` (K, 2) [m] of round ramps, and the direction in which each ascends, ``uphill`` (K,)
    [rad]."""

    middles: NDArray[np.float64]
    uphill: NDArray[np.float64]
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "middles", frozen_array(self.middles, np.float64))
        object.__setattr__(self, "uphill", frozen_array(self.uphill, np.float64))

    def uphill_at(self, place: NDArray[np.float64]) -> float | None:
        """Return the direction in which the nearest ramp around a place (2,) ascends [rad], None on level floor."""
        gaps = np.hypot(*(self.middles - place).T)
        return float(self.uphill[gaps.argmin()]) if (gaps < self.radius).any() else None


def build_ramps(floor: FreeFloor, adversity: Adversity, seed: int) -> Ramps:
    """Draw the places and directions of the ramps; those of a lower density are among those of a higher one."""
    rngs = [stream(seed, Role.RAMPS, number) for number in range(floor.count(adversity.ramps))]
    middles = [floor.random_place(rng) for rng in rngs]
    return Ramps(
        np.array(middles).reshape(-1, 2),
        np.array([rng.uniform(-math.pi, math.pi) for rng in rngs]),
        adversity.ramp_radius,
    )


def tilted_ranges(
    ranges: NDArray[np.float64], angles: NDArray[np.float64], slope: float, height: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the ranges (B,) [m] of a lidar that is tilted by ``slope`` [rad], and which of its beams hit the floor.

    ``ranges`` (B,) are those of the level lidar, ``angles`` (B,) [rad] point from uphill to each beam, ``height`` [m]
    is that of the lidar above the floor. A beam at elevation e is longer by 1 / cos e, since walls are upright, and
    ends on the floor after ``height`` / sin(-e). Walls have no upper end, and the floor around the ramp is level.
    """
    sine = np.sin(slope) * np.cos(angles)
    to_wall = ranges / np.sqrt(1.0 - sine**2)
    to_floor = np.divide(height, -sine, out=np.full(len(sine), np.inf), where=sine < 0.0)
    return np.minimum(to_wall, to_floor), to_floor < to_wall
