"""Add sensor noise to a clean mission, as a pure function of the mission and the seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.robot.robot_log import RobotLog, RobotTruth
from mapping.robot.trajectory import Trajectory
from mapping.seeds import Role, stream
from sim.sensors.adversity.late_scans import delay_scans, draw_delays
from sim.sensors.adversity.surroundings import Surroundings, adverse_scans
from sim.sensors.adversity.wheel_slip import add_slips, draw_slips
from sim.sensors.noise import Noise
from sim.sensors.odometry import draw_bias, simulate_odometry
from sim.sensors.range_noise import add_range_noise, range_draws


@dataclass(frozen=True, eq=False)
class SensedLog:
    """Hold the noisy ``log`` of one robot and the mask of ``outliers`` (N, B) among its readings.

    Outliers are lost, short and random readings, and those of beams that jitter or adversity ended on another surface.
    """

    log: RobotLog
    outliers: NDArray[np.bool_]


def sense(
    truth: RobotTruth, noise: Noise, seed: int, robot_index: int, around: Surroundings | None = None
) -> SensedLog:
    """Add noise to the true scans and trajectory of robot ``robot_index``.

    Each component has its own random stream and draws the same number of values at every level. A change of one level
    scales that component's errors and leaves the draws of the others unchanged. Odometry starts at the identity. Noise
    of level 0 returns the truth exactly: the true ranges, and ``truth.trajectory.from_start()``. ``around`` are the
    team's ``draw_surroundings`` for this noise. Raises ``ValueError`` if the adversity needs them and there are none.
    """
    if noise.adversity.in_world and around is None:
        raise ValueError(
            "sense: the adversity has people, doors, objects, glass or ramps, but there are no surroundings"
        )
    clean, changed = (truth.scans, False) if around is None else adverse_scans(truth, around)
    draws = range_draws(seed, robot_index, truth.hits_robot.shape[1])
    sensed = [add_range_noise(scan, noise.lidar, draw) for scan, draw in zip(clean, draws, strict=False)]
    log = RobotLog(tuple(scan for scan, _ in sensed), _odometry(truth, noise, seed, robot_index), truth.base_from_lidar)
    return SensedLog(log, np.array([outliers for _, outliers in sensed]) | changed)


def _odometry(truth: RobotTruth, noise: Noise, seed: int, robot_index: int) -> Trajectory:
    """Return the odometry that each scan is paired with."""
    true, adversity = truth.trajectory, noise.adversity
    bias = draw_bias(noise.odometry, stream(seed, Role.ODOMETRY_BIAS, robot_index))
    odometry = simulate_odometry(true, noise.odometry, bias, stream(seed, Role.ODOMETRY_NOISE, robot_index))
    slips = draw_slips(true, adversity, stream(seed, Role.WHEEL_SLIP, robot_index))
    delays = draw_delays(len(true), adversity, stream(seed, Role.SCAN_DELAY, robot_index))
    return delay_scans(add_slips(odometry, slips), delays)
