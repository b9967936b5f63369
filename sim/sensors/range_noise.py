"""Add noise to lidar scans, and draw the random numbers for it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from mapping.robot.scan import LidarScan
from mapping.seeds import Role, stream
from sim.sensors.angular_jitter import apply_angular_jitter

_PROBABILITIES = ("dropout", "short", "random")
LARGEST_NOISE = 1e6
"""Upper bound of every component, in its own unit."""

_OF_THE_DEVICE = ("quantum", "short_mean")


@dataclass(frozen=True)
class RangeNoise:
    """Hold the noise of a lidar's readings. The defaults are a usual small lidar at level 1.

    A reading of r metres gets a normal error of standard deviation ``range_sigma`` [m] + ``range_sigma_ratio`` r, and a
    bias of ``bias_sigma`` [m] + ``bias_sigma_ratio`` r times one normal draw per robot. The direction of each beam gets
    a normal error of ``angle_sigma`` [rad], drawn anew for each scan. Readings are rounded to multiples of ``quantum``
    [m]; 0 for no rounding. With probability ``short`` an unexpected object blocks the beam, at an exponentially
    distributed distance of mean ``short_mean`` [m]. With probability ``random`` the reading is uniform in the lidar's
    range. With probability ``dropout`` it is lost.

    Raises ``ValueError`` with the field and its value.
    """

    range_sigma: float = 0.01
    range_sigma_ratio: float = 0.005
    bias_sigma: float = 0.0
    bias_sigma_ratio: float = 0.0
    angle_sigma: float = 0.0
    quantum: float = 0.0
    dropout: float = 0.01
    short: float = 0.0
    short_mean: float = 1.0
    random: float = 0.0

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if not 0.0 <= value <= LARGEST_NOISE:
                raise ValueError(f"RangeNoise: {each.name} is {value}, must lie between 0 and {LARGEST_NOISE:g}")
        for name in _PROBABILITIES:
            if getattr(self, name) > 1.0:
                raise ValueError(f"RangeNoise: {name} is {getattr(self, name)}, must be a probability of at most 1")
        if self.short_mean == 0.0:
            raise ValueError("RangeNoise: short_mean is 0.0, must be positive")

    def scaled(self, level: float) -> RangeNoise:
        """Multiply all standard deviations and probabilities by ``level``, probabilities up to 1.

        ``quantum`` and ``short_mean`` are properties of the device and the world and stay, but level 0 switches
        rounding off.
        """
        if level == 0.0:
            return replace(self, **{each.name: 0.0 for each in fields(self) if each.name != "short_mean"})
        names = [each.name for each in fields(self) if each.name not in _OF_THE_DEVICE]
        scaled = {name: level * getattr(self, name) for name in names}
        return replace(self, **scaled | {name: min(1.0, scaled[name]) for name in _PROBABILITIES})


@dataclass(frozen=True, eq=False)
class RangeDraws:
    """Hold the random numbers of one scan of B beams.

    Normal ``errors`` and ``angles`` (B,), the robot's normal ``bias``, uniform ``dropout`` (B,), uniform ``short`` and
    ``random`` (2, B): row 0 decides if the reading is replaced, row 1 gives the distance.
    """

    errors: NDArray[np.float64]
    angles: NDArray[np.float64]
    bias: float
    dropout: NDArray[np.float64]
    short: NDArray[np.float64]
    random: NDArray[np.float64]


def range_draws(seed: int, robot_index: int, beams: int) -> Iterator[RangeDraws]:
    """Yield the random numbers of one robot, scan after scan, without end.

    Each component has its own stream and draws the same number of values at every level.
    """
    errors, angles, bias, dropout, short, random = (
        stream(seed, role, robot_index)
        for role in (
            Role.RANGE_NOISE,
            Role.ANGULAR_JITTER,
            Role.LIDAR_BIAS,
            Role.DROPOUT,
            Role.SHORT_READINGS,
            Role.RANDOM_READINGS,
        )
    )
    device = float(bias.standard_normal())
    while True:
        yield RangeDraws(
            errors.standard_normal(beams),
            angles.standard_normal(beams),
            device,
            dropout.random(beams),
            short.random((2, beams)),
            random.random((2, beams)),
        )


def add_range_noise(scan: LidarScan, noise: RangeNoise, draws: RangeDraws) -> tuple[LidarScan, NDArray[np.bool_]]:
    """Add noise to a clean scan. Returns the scan and a mask (B,) of its outliers.

    Samples from the beam model of Thrun, Burgard and Fox, Probabilistic Robotics (2005), section 6.3. A lost reading
    takes precedence over a random one, and a random over a short one. Readings beyond the lidar's limits become +inf or
    -inf, lost ones +inf (REP 117). A beam without a return cannot be lost.
    """
    true, elsewhere = apply_angular_jitter(scan, noise.angle_sigma * draws.angles)
    hit = np.isfinite(true)
    reach = np.where(hit, true, 0.0)
    error = (noise.range_sigma + noise.range_sigma_ratio * reach) * draws.errors
    bias = (noise.bias_sigma + noise.bias_sigma_ratio * reach) * draws.bias
    read = np.where(hit, reach + error + bias, true)
    is_short = (draws.short[0] < noise.short) & (true != -np.inf)
    read = np.where(is_short, _short_readings(scan, true, noise.short_mean, draws.short[1]), read)
    is_random = draws.random[0] < noise.random
    read = np.where(is_random, scan.range_min + (scan.range_max - scan.range_min) * draws.random[1], read)
    if noise.quantum > 0.0:
        read = noise.quantum * np.rint(read / noise.quantum)
    lost = (draws.dropout < noise.dropout) & (read != np.inf)
    read[lost] = np.inf
    return within_limits(scan, read), elsewhere | is_short | is_random | lost


def _short_readings(
    scan: LidarScan, true: NDArray[np.float64], mean: float, draws: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Sample the exponential distribution between 0 and the true reading (equation 6.6) by its inverse."""
    farthest = np.minimum(true, scan.range_max)
    return -mean * np.log1p(draws * np.expm1(-np.maximum(farthest, 0.0) / mean))


def within_limits(scan: LidarScan, read: NDArray[np.float64]) -> LidarScan:
    """Return the scan with these readings (B,) [m]. Beyond the lidar's limits they become +inf or -inf (REP 117)."""
    ranges = read.astype(np.float32)
    ranges[ranges > np.float32(scan.range_max)] = np.inf
    ranges[ranges < np.float32(scan.range_min)] = -np.inf
    return replace(scan, ranges=ranges)
