"""Pair scans with the odometry of a later moment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mapping.robot.trajectory import Trajectory
from sim.sensors.adversity.settings import Adversity


def draw_delays(scans: int, adversity: Adversity, rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw the delay of each scan (N,) [s]. ``rng`` draws one number per scan whatever the settings."""
    return adversity.latency + adversity.jitter * rng.standard_exponential(scans)


def delay_scans(odometry: Trajectory, delays: NDArray[np.float64]) -> Trajectory:
    """Return the odometry that late scans are paired with: at each stamp, the pose ``delays`` (N,) [s] later.

    Poses are interpolated; after the last one the robot stands still. The result starts at the identity again. Without
    delays the odometry is returned as it is.
    """
    if not delays.any():
        return odometry
    x, y, yaw = odometry.poses.T
    late = odometry.stamps + delays
    columns = [np.interp(late, odometry.stamps, column) for column in (x, y, np.unwrap(yaw))]
    return Trajectory(odometry.stamps, np.stack(columns, axis=-1)).from_start()
