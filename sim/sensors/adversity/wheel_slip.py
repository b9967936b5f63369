"""Let the wheels slip while the robot turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mapping.robot.trajectory import Trajectory
from sim.sensors.adversity.settings import Adversity


def draw_slips(true: Trajectory, adversity: Adversity, rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw the rotation that slipping wheels add to each step (N - 1,) [rad], in the direction in which it turns.

    Slips are a Poisson process of the angle turned, so that their number does not depend on the number of steps. Their
    sizes are Lomax variates: the chance of more than x is (1 + x / ``slip_size``) ^ -``slip_tail``. ``rng`` draws two
    numbers per step whatever the settings.
    """
    turn = np.diff(true.poses[:, 2])
    turn = np.arctan2(np.sin(turn), np.cos(turn))
    chance, rank = rng.random((2, len(turn)))
    sizes = adversity.slip_size * np.expm1(-np.log1p(-rank) / adversity.slip_tail)
    return np.where(chance < -np.expm1(-adversity.slip * np.abs(turn)), np.sign(turn) * sizes, 0.0)


def add_slips(odometry: Trajectory, slips: NDArray[np.float64]) -> Trajectory:
    """Turn the odometry after each step by its slip (N - 1,) [rad]. Without slips it is returned as it is."""
    if not slips.any():
        return odometry
    poses, steps = odometry.poses.copy(), np.diff(odometry.poses[:, :2], axis=0)
    turned = np.concatenate(([0.0], np.cumsum(slips)))
    c, s = np.cos(turned[:-1]), np.sin(turned[:-1])
    moved = np.stack((c * steps[:, 0] - s * steps[:, 1], s * steps[:, 0] + c * steps[:, 1]), axis=-1)
    poses[1:, :2] = poses[0, :2] + np.cumsum(moved, axis=0)
    poses[:, 2] += turned
    return Trajectory(odometry.stamps, poses)
