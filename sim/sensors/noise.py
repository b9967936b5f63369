"""Add sensor noise to a clean mission, as a pure function of the mission and the seed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace

import numpy as np
from numpy.typing import NDArray

from mapping.robot.robot_log import RobotLog, RobotTruth
from mapping.seeds import Role, stream
from sim.sensors.odometry import OdometryNoise, draw_bias, simulate_odometry
from sim.sensors.range_noise import RangeNoise, add_range_noise, range_draws

WORST_LEVEL = 20.0
"""Highest noise level; beyond it no map is recognizable."""


@dataclass(frozen=True)
class Noise:
    """Hold the noise of lidar and odometry. The defaults are level 1: a common small lidar on an ordinary robot."""

    lidar: RangeNoise = field(default_factory=RangeNoise)
    odometry: OdometryNoise = field(default_factory=OdometryNoise)

    @staticmethod
    def level(level: float, lidar: RangeNoise | None = None) -> Noise:
        """Multiply all standard deviations and probabilities by ``level``: 0 is exact, 3 a bad robot.

        ``lidar`` is the lidar's noise at level 1 (default: a usual small lidar). Quantisation is not multiplied, but
        switched off at level 0. Raises ``ValueError`` if the level is negative, not a number, or above 20.
        """
        if not 0.0 <= level <= WORST_LEVEL:
            raise ValueError(f"noise is {level}, must lie between 0 and {WORST_LEVEL:g}")
        return Noise((lidar or RangeNoise()).scaled(level), OdometryNoise().scaled(level))

    def with_fields(self, values: Iterable[tuple[str, float]]) -> Noise:
        """Set single components by name, for example ``lidar.range_sigma`` or ``odometry.alpha1``.

        Raises ``ValueError`` with the component and its value if the component is unknown or the value is not allowed.
        """
        changed = self
        for name, value in values:
            if name not in COMPONENTS:
                raise ValueError(f"noise component {name!r} is unknown; known are {', '.join(COMPONENTS)}")
            part, _, component = name.partition(".")
            if part == "lidar":
                changed = replace(changed, lidar=replace(changed.lidar, **{component: value}))
            else:
                changed = replace(changed, odometry=replace(changed.odometry, **{component: value}))
        return changed


COMPONENTS = (
    *(f"lidar.{each.name}" for each in fields(RangeNoise)),
    *(f"odometry.{each.name}" for each in fields(OdometryNoise)),
)
"""Names of all noise components."""


@dataclass(frozen=True, eq=False)
class SensedLog:
    """Hold the noisy ``log`` of one robot and the mask of ``outliers`` (N, B) among its readings.

    Outliers are lost, short and random readings, and those of beams that jitter moved to another surface.
    """

    log: RobotLog
    outliers: NDArray[np.bool_]


def sense(truth: RobotTruth, noise: Noise, seed: int, robot_index: int) -> SensedLog:
    """Add noise to the true scans and trajectory of robot ``robot_index``.

    Each component has its own random stream and draws the same number of values at every level. A change of one level
    scales that component's errors and leaves the draws of the others unchanged. Odometry starts at the identity. Noise
    of level 0 returns the truth exactly: the true ranges, and ``truth.trajectory.from_start()``.
    """
    draws = range_draws(seed, robot_index, truth.hits_robot.shape[1])
    sensed = [add_range_noise(scan, noise.lidar, draw) for scan, draw in zip(truth.scans, draws, strict=False)]
    bias = draw_bias(noise.odometry, stream(seed, Role.ODOMETRY_BIAS, robot_index))
    odometry = simulate_odometry(truth.trajectory, noise.odometry, bias, stream(seed, Role.ODOMETRY_NOISE, robot_index))
    log = RobotLog(tuple(scan for scan, _ in sensed), odometry, truth.base_from_lidar)
    return SensedLog(log, np.array([outliers for _, outliers in sensed]))
