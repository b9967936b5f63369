"""What a robot senses of what truly happened: noise as a pure function of a clean mission."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from mapping.robot_log import RobotLog, RobotTruth
from mapping.scan import LidarScan
from mapping.seeds import Role, stream
from sim.odometry import OdometryNoise, drifted


@dataclass(frozen=True)
class Noise:
    """How a robot's sensors err. The defaults are a usual small lidar on a decent robot: level 1.

    A reading of r metres gets a normal error of standard deviation ``range_sigma`` + ``range_sigma_ratio`` r [m];
    each beam is lost with probability ``dropout``; ``odometry`` drifts by its alphas.

    Raises ``ValueError`` naming the field and its value.
    """

    range_sigma: float = 0.01
    range_sigma_ratio: float = 0.005
    dropout: float = 0.01
    odometry: OdometryNoise = field(default_factory=OdometryNoise)

    def __post_init__(self) -> None:
        for name in ("range_sigma", "range_sigma_ratio", "dropout"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"Noise: {name} is {value}, must be finite and not negative")
        if self.dropout > 1.0:
            raise ValueError(f"Noise: dropout is {self.dropout}, a probability is at most 1")

    @staticmethod
    def level(level: float) -> Noise:
        """All standard deviations and probabilities of the defaults times ``level``: 0 is exact, 3 a bad robot.

        Raises ``ValueError`` where the level is negative or no number.
        """
        if not (math.isfinite(level) and level >= 0.0):
            raise ValueError(f"noise is {level}, must be finite and not negative")
        usual = Noise()
        return Noise(
            level * usual.range_sigma,
            level * usual.range_sigma_ratio,
            min(1.0, level * usual.dropout),
            OdometryNoise(*(level * getattr(usual.odometry, each.name) for each in fields(OdometryNoise))),
        )


@dataclass(frozen=True, eq=False)
class Sensed:
    """The ``log`` that a robot brings home, and which of its readings the noise ``replaced``, (N, B): those it lost."""

    log: RobotLog
    replaced: NDArray[np.bool_]


def sense(truth: RobotTruth, noise: Noise, seed: int, robot_index: int) -> Sensed:
    """Draw noise on what truly happened to robot ``robot_index``.

    Range noise, dropout and odometry have random streams of their own, and each draws as many numbers whatever the
    level: raising one level scales that component's errors and leaves the others' as they are. A reading that the
    noise pushes past the lidar's limits becomes +inf or -inf, a lost one +inf (REP 117). Odometry starts at the
    identity. Noise of level 0 gives the truth exactly: true ranges, and ``truth.trajectory.from_start()``.
    """
    shape = truth.hits_robot.shape
    range_draws = stream(seed, Role.RANGE_NOISE, robot_index).standard_normal(shape)
    lost = stream(seed, Role.DROPOUT, robot_index).random(shape) < noise.dropout
    scans = tuple(_sensed(scan, noise, range_draws[k], lost[k]) for k, scan in enumerate(truth.scans))
    odometry = drifted(truth.trajectory, noise.odometry, stream(seed, Role.ODOMETRY_NOISE, robot_index))
    returned = np.array([scan.ranges != np.inf for scan in truth.scans])
    return Sensed(RobotLog(scans, odometry, truth.base_from_lidar), lost & returned)


def _sensed(scan: LidarScan, noise: Noise, draws: NDArray[np.float64], lost: NDArray[np.bool_]) -> LidarScan:
    true = np.where(scan.returned, scan.ranges, 0.0).astype(np.float64)
    noisy = (true + (noise.range_sigma + noise.range_sigma_ratio * true) * draws).astype(np.float32)
    noisy[noisy > np.float32(scan.range_max)] = np.inf
    noisy[noisy < np.float32(scan.range_min)] = -np.inf
    ranges = np.where(scan.returned, noisy, scan.ranges)
    ranges[lost] = np.inf
    return LidarScan(scan.stamp, scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max, ranges)
