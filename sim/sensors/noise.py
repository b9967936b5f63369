"""What a robot senses of what truly happened: noise as a pure function of a clean mission."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace

import numpy as np
from numpy.typing import NDArray

from mapping.robot.robot_log import RobotLog, RobotTruth
from mapping.seeds import Role, stream
from sim.sensors.odometry import OdometryNoise, draw_bias, drifted
from sim.sensors.range_noise import RangeNoise, noisy, range_draws

WORST_LEVEL = 20.0
"""Robots of a noise level beyond it would not know a room from a street."""


@dataclass(frozen=True)
class Noise:
    """How a robot's sensors err. The defaults are a usual small lidar on a decent robot: level 1."""

    lidar: RangeNoise = field(default_factory=RangeNoise)
    odometry: OdometryNoise = field(default_factory=OdometryNoise)

    @staticmethod
    def level(level: float, lidar: RangeNoise | None = None) -> Noise:
        """All standard deviations and probabilities times ``level``: 0 is exact, 3 a bad robot.

        ``lidar`` is how the lidar errs at level 1; default: a usual small one. Quantisation is not multiplied, but
        switched off at 0. Raises ``ValueError`` where the level is negative, no number, or past anything that drives.
        """
        if not 0.0 <= level <= WORST_LEVEL:
            raise ValueError(f"noise is {level}, must lie between 0 and {WORST_LEVEL:g}")
        return Noise((lidar or RangeNoise()).scaled(level), OdometryNoise().scaled(level))

    def with_fields(self, values: Iterable[tuple[str, float]]) -> Noise:
        """This noise with single components set, named as in ``lidar.range_sigma`` or ``odometry.alpha1``.

        Raises ``ValueError`` naming the component and its value where one is unknown or the value bad.
        """
        changed = self
        for name, value in values:
            if name not in COMPONENTS:
                raise ValueError(f"{name} is no component of the noise; known are {', '.join(COMPONENTS)}")
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
"""The noise's components by name."""


@dataclass(frozen=True, eq=False)
class Sensed:
    """The ``log`` that a robot brings home, and which of its readings the noise ``replaced``, (N, B): lost, short and
    random ones, and those of beams that jitter turned onto something else."""

    log: RobotLog
    replaced: NDArray[np.bool_]


def sense(truth: RobotTruth, noise: Noise, seed: int, robot_index: int) -> Sensed:
    """Draw noise on what truly happened to robot ``robot_index``.

    Each component has a random stream of its own, and draws as many numbers whatever the level: raising one level
    scales that component's errors and leaves the others' draws as they are. Odometry starts at the identity. Noise
    of level 0 gives the truth exactly: true ranges, and ``truth.trajectory.from_start()``.
    """
    draws = range_draws(seed, robot_index, truth.hits_robot.shape[1])
    sensed = [noisy(scan, noise.lidar, draw) for scan, draw in zip(truth.scans, draws, strict=False)]
    bias = draw_bias(noise.odometry, stream(seed, Role.ODOMETRY_BIAS, robot_index))
    odometry = drifted(truth.trajectory, noise.odometry, bias, stream(seed, Role.ODOMETRY_NOISE, robot_index))
    log = RobotLog(tuple(scan for scan, _ in sensed), odometry, truth.base_from_lidar)
    return Sensed(log, np.array([replaced for _, replaced in sensed]))
