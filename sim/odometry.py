"""How odometry drifts."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from mapping.trajectory import Trajectory

STANDING = 1e-6
"""A motion shorter than this [m] has no direction."""


@dataclass(frozen=True)
class OdometryNoise:
    """The odometry motion model's four alphas, as standard deviations: ``alpha1`` of rotation from rotation,
    ``alpha2`` of rotation from translation, ``alpha3`` of translation from translation, ``alpha4`` of translation
    from rotation.

    They hold for one metre or one radian of motion, and the variance grows in proportion to the motion. (The book
    makes the deviation of each step proportional to the step: then the drift of one path depends on how finely it is
    cut, and a faster lidar would mean a better odometry.) The defaults give 3 to 6 degrees of yaw and 1 to 2 % of
    the distance as RMS error at the end of 120 s of exploring an office.

    Raises ``ValueError`` naming the field and its value.
    """

    alpha1: float = 0.007
    alpha2: float = 0.006
    alpha3: float = 0.03
    alpha4: float = 0.01

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"OdometryNoise: {each.name} is {value}, must be finite and not negative")


def drifted(true: Trajectory, noise: OdometryNoise, rng: np.random.Generator) -> Trajectory:
    """odom_from_base: the true path from its start, each step turned, stretched and turned again by a random error.

    Thrun, Burgard and Fox, Probabilistic Robotics (2005), table 5.6: a step is a rotation, a translation and a
    rotation; backward motion counts as a translation backwards. With all alphas 0 it is the true path exactly, as
    only the error is summed up.
    """
    path = true.from_start()
    steps = np.diff(path.poses[:, :2], axis=0)
    turn1, length, turn2 = _decomposed(path, steps)
    draws = rng.standard_normal((len(steps), 3))
    error1 = np.sqrt(noise.alpha1**2 * turn1 + noise.alpha2**2 * length) * draws[:, 0]
    stretch = np.sqrt(noise.alpha3**2 * length + noise.alpha4**2 * (turn1 + turn2)) * draws[:, 1]
    error2 = np.sqrt(noise.alpha1**2 * turn2 + noise.alpha2**2 * length) * draws[:, 2]
    yaw_error = np.concatenate(([0.0], np.cumsum(error1 + error2)))
    direction = np.where(
        length[:, None] > STANDING,
        steps / np.maximum(length, STANDING)[:, None],
        np.stack((np.cos(path.poses[:-1, 2]), np.sin(path.poses[:-1, 2])), axis=-1),
    )
    believed = _turned(steps + stretch[:, None] * direction, yaw_error[:-1] + error1)
    poses = path.poses.copy()
    poses[1:, :2] += np.cumsum(believed - steps, axis=0)
    poses[:, 2] += yaw_error
    return Trajectory(path.stamps, poses)


def _decomposed(
    path: Trajectory, steps: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """How much each step turns at first [rad], how far it goes [m], and how much it turns at last [rad], unsigned."""
    length = np.hypot(steps[:, 0], steps[:, 1])
    yaw = path.poses[:, 2]
    turn = _wrapped(np.diff(yaw))
    first = _wrapped(np.arctan2(steps[:, 1], steps[:, 0]) - yaw[:-1])
    first = np.where(np.abs(first) > math.pi / 2.0, _wrapped(first - math.pi), first)
    first = np.where(length > STANDING, first, 0.0)
    return np.abs(first), length, np.abs(_wrapped(turn - first))


def _turned(vectors: NDArray[np.float64], angles: NDArray[np.float64]) -> NDArray[np.float64]:
    c, s = np.cos(angles), np.sin(angles)
    return np.stack((c * vectors[:, 0] - s * vectors[:, 1], s * vectors[:, 0] + c * vectors[:, 1]), axis=-1)


def _wrapped(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.arctan2(np.sin(angles), np.cos(angles))
