"""Describe a 2-D lidar and its mounting pose."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.robot.scan import LidarScan

MAX_BEAMS = 100_000
"""Most beams of a scan: those of the finest scanners on the market are 36,000."""

MAX_RATE = 1_000.0
"""Highest rate of scans [Hz]: a simulation steps no finer."""


@dataclass(frozen=True)
class Lidar:
    """Describe a lidar whose beam ``k`` of ``beams`` points along ``angle_min + k * angle_increment`` [rad].

    ``range_min`` and ``range_max`` are in metres, ``rate`` is in scans per second (a scan is instantaneous), and
    ``base_from_lidar`` is the mounting pose on the robot. ``model`` names the preset that gives the noise
    (:mod:`sim.sensors.lidar_presets`).

    Raises ``ValueError`` with the field and its value.
    """

    beams: int = 360
    angle_min: float = -math.pi
    angle_increment: float = math.tau / 360
    range_min: float = 0.15
    range_max: float = 12.0
    rate: float = 10.0
    base_from_lidar: SE2 = field(default_factory=SE2)
    model: str = "default"

    def __post_init__(self) -> None:
        if not 1 <= self.beams <= MAX_BEAMS:
            raise ValueError(f"Lidar: beams is {self.beams}, must lie between 1 and {MAX_BEAMS}")
        for name in ("angle_min", "angle_increment", "range_min", "range_max", "rate"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"Lidar: {name} is {getattr(self, name)}, must be finite")
        if self.angle_increment == 0.0 or abs(self.angle_increment) * (self.beams - 1) > math.tau + 1e-6:
            raise ValueError(
                f"Lidar: angle_increment is {self.angle_increment}, {self.beams} beams must lie within a turn"
            )
        if self.range_min < 0.0:
            raise ValueError(f"Lidar: range_min is {self.range_min}, must be at least 0")
        if self.range_max <= self.range_min:
            raise ValueError(f"Lidar: range_max is {self.range_max}, must exceed range_min {self.range_min}")
        if not 0.0 < self.rate <= MAX_RATE:
            raise ValueError(f"Lidar: rate is {self.rate}, must be positive and at most {MAX_RATE:g} Hz")

    @property
    def angles(self) -> NDArray[np.float64]:
        """Return the beam directions in the lidar's frame [rad], (beams,)."""
        return self.angle_min + self.angle_increment * np.arange(self.beams, dtype=np.float64)

    def scan(self, stamp: float, distances: NDArray[np.float64]) -> LidarScan:
        """Build the scan with these distances (beams,) [m]. Beyond the limits they become +inf or -inf (REP 117)."""
        low, high = np.float32(self.range_min), np.float32(self.range_max)
        ranges = distances.astype(np.float32)
        ranges[ranges > high] = np.inf
        ranges[ranges < low] = -np.inf
        return LidarScan(stamp, self.angle_min, self.angle_increment, self.range_min, self.range_max, ranges)
