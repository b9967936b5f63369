"""Odometry motion model: a step is a rotation, a translation and a rotation, each with an error of its own.

Source: Thrun, Burgard and Fox, "Probabilistic Robotics" (2005), section 5.4.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2, wrap_angle
from mapping.particle.settings import MotionNoise

STANDING = 1e-6
"""Motions shorter than this [m] have no direction."""


def sample_motion(
    poses: NDArray[np.float64], motion: SE2, noise: MotionNoise, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Move poses (N, 3) by an odometry motion with a random error each (table 5.6). Returns poses (N, 3)."""
    steps = _steps(motion) + _deviations(motion, noise) * rng.standard_normal((len(poses), 3))
    heading = poses[:, 2] + steps[:, 0]
    moved = np.empty_like(poses)
    moved[:, 0] = poses[:, 0] + steps[:, 1] * np.cos(heading)
    moved[:, 1] = poses[:, 1] + steps[:, 1] * np.sin(heading)
    moved[:, 2] = heading + steps[:, 2]
    return moved


def motion_covariance(motion: SE2, noise: MotionNoise) -> NDArray[np.float64]:
    """Return the covariance (3, 3) [m, m, rad] of a motion, in the frame of the pose before it, to first order."""
    first, length, _ = _steps(motion)
    c, s = math.cos(first), math.sin(first)
    jacobian = np.array([[-length * s, c, 0.0], [length * c, s, 0.0], [1.0, 0.0, 1.0]])
    covariance: NDArray[np.float64] = (jacobian * _deviations(motion, noise) ** 2) @ jacobian.T
    return covariance


def _steps(motion: SE2) -> NDArray[np.float64]:
    """Split a motion into first rotation [rad], translation [m] (negative: backwards) and last rotation [rad]."""
    length = math.hypot(motion.x, motion.y)
    if length < STANDING:
        return np.array([0.0, 0.0, motion.yaw])
    first = math.atan2(motion.y, motion.x)
    if abs(first) > math.pi / 2.0:
        first, length = wrap_angle(first - math.pi), -length
    return np.array([first, length, wrap_angle(motion.yaw - first)])


def _deviations(motion: SE2, noise: MotionNoise) -> NDArray[np.float64]:
    """Return the standard deviations (3,) of first rotation [rad], translation [m] and last rotation [rad]."""
    first, length, last = np.abs(_steps(motion))
    return np.array(
        [
            math.hypot(noise.rotation_from_rotation * first, noise.rotation_from_translation * length),
            math.hypot(noise.translation_from_translation * length, noise.translation_from_rotation * (first + last)),
            math.hypot(noise.rotation_from_rotation * last, noise.rotation_from_translation * length),
        ]
    )
