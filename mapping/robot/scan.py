"""One sweep of a 2-D lidar, named as sensor_msgs/LaserScan names it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapping.arrays import frozen_array, sealed


@dataclass(frozen=True, eq=False)
class LidarScan:
    """One sweep: beam ``k`` points along ``angle_min + k * angle_increment`` in the lidar's frame.

    ``stamp`` in seconds, angles in radians counter-clockwise, ranges in metres. ``ranges`` (B,) float32 holds
    finite readings within [range_min, range_max], ``+inf`` without a return and ``-inf`` if something was
    too close (REP 117).

    Raises ``ValueError`` naming the field: no beam, a range that is NaN or outside the limits, beams that all
    point one way or sweep more than a full turn, limits out of order.
    """

    stamp: float
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: NDArray[np.float32]

    def __post_init__(self) -> None:
        object.__setattr__(self, "ranges", frozen_array(self.ranges, np.float32))
        self._check()

    def _check(self) -> None:
        if self.ranges.ndim != 1 or self.ranges.size == 0:
            raise ValueError(f"LidarScan: ranges has shape {self.ranges.shape}, needs (B,) with at least one beam")
        for name in ("stamp", "angle_min", "angle_increment", "range_min", "range_max"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"LidarScan: {name} is {getattr(self, name)}, not a finite number")
        if not 0.0 <= self.range_min < self.range_max:
            raise ValueError(f"LidarScan: range_min {self.range_min} and range_max {self.range_max} are out of order")
        if self.angle_increment == 0.0:
            raise ValueError("LidarScan: angle_increment is zero: all beams would point one way")
        if abs(self.angle_increment) * (self.ranges.size - 1) > math.tau + 1e-6:
            raise ValueError(
                f"LidarScan: {self.ranges.size} beams at angle_increment {self.angle_increment} rad exceed a turn"
            )
        if np.isnan(self.ranges).any():
            raise ValueError(f"LidarScan: the range of beam {int(np.isnan(self.ranges).argmax())} is NaN")
        low, high = np.float32(self.range_min), np.float32(self.range_max)
        outside = self.returned & ((self.ranges < low) | (self.ranges > high))
        if outside.any():
            beam = int(outside.argmax())
            raise ValueError(
                f"LidarScan: the range of beam {beam} is {self.ranges[beam]} m, "
                f"outside [{self.range_min}, {self.range_max}]"
            )

    @staticmethod
    def of_readings(
        stamp: float,
        angle_min: float,
        angle_increment: float,
        range_min: float,
        range_max: float,
        readings: ArrayLike,
    ) -> LidarScan:
        """Make a sweep of the raw readings (B,) [m] of a driver.

        A reading that is NaN or reaches ``range_max`` is no return; one below ``range_min``, or not positive, was too
        close (REP 117 for the values that result). Raises ``ValueError`` as the class does.
        """
        ranges = np.array(readings, dtype=np.float32)
        lost = np.isnan(ranges) | (ranges >= np.float32(range_max))
        close = ~lost & ((ranges < np.float32(range_min)) | (ranges <= 0.0))
        ranges[lost], ranges[close] = np.inf, -np.inf
        return LidarScan(stamp, angle_min, angle_increment, range_min, range_max, sealed(ranges))

    @property
    def returned(self) -> NDArray[np.bool_]:
        """True for each beam (B,) that measured a distance."""
        return np.isfinite(self.ranges)

    @property
    def angles(self) -> NDArray[np.float64]:
        """Directions of the beams in the lidar's frame [rad], (B,)."""
        return self.angle_min + self.angle_increment * np.arange(self.ranges.size, dtype=np.float64)

    def points(self) -> NDArray[np.float64]:
        """Return the endpoints of the beams with a return, in the lidar's frame [m], (N, 2) in the beams' order."""
        r, a = self.ranges[self.returned].astype(np.float64), self.angles[self.returned]
        return np.stack((r * np.cos(a), r * np.sin(a)), axis=-1)
