"""How odometry drifts: noise on each step, and a bias that lasts for the whole run."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from mapping.robot.trajectory import Trajectory

STANDING = 1e-6
"""A motion shorter than this [m] has no direction."""


LARGEST_NOISE = 10.0
"""No component is larger, in whatever unit: a metre driven would be believed ten, or turned about more than once."""


@dataclass(frozen=True)
class OdometryNoise:
    """The odometry motion model's four alphas, and how far off a run's wheels are, all as standard deviations.

    ``alpha1`` of rotation from rotation, ``alpha2`` of rotation from translation, ``alpha3`` of translation from
    translation, ``alpha4`` of translation from rotation: they hold for one metre or one radian of motion, and the
    variance grows in proportion to the motion. (The book makes the deviation of each step proportional to the step:
    then the drift of one path depends on how finely it is cut, and a faster lidar would mean a better odometry.)

    ``radius_sigma``: relative error of both wheels' radius, which stretches translation and rotation alike;
    ``track_sigma``: relative error of the track, which shrinks rotation; ``veer_sigma`` [rad/m]: the turn that is
    believed of straight driving, which is the relative difference of the two radii over the track. A run draws each
    once. (Stage, model_position.cc, draws up to 1.5 % of translation and 2.5 % of rotation; calibrated wheels, as of
    Borenstein and Feng, "UMBmark", 1995, do better by an order of magnitude.)

    The defaults give 3 to 6 degrees of yaw and 1 to 2 % of the distance as RMS error at the end of 120 s of
    exploring an office. Raises ``ValueError`` naming the field and its value.
    """

    alpha1: float = 0.005
    alpha2: float = 0.005
    alpha3: float = 0.02
    alpha4: float = 0.01
    radius_sigma: float = 0.003
    track_sigma: float = 0.003
    veer_sigma: float = 0.0005

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if not 0.0 <= value <= LARGEST_NOISE:
                raise ValueError(f"OdometryNoise: {each.name} is {value}, must lie between 0 and {LARGEST_NOISE:g}")

    def scaled(self, level: float) -> OdometryNoise:
        """All standard deviations times ``level``."""
        return OdometryNoise(*(level * getattr(self, each.name) for each in fields(self)))


@dataclass(frozen=True)
class WheelBias:
    """What one run believes wrongly: relative errors of translation and of rotation, and a turn per metre [rad/m]."""

    translation: float
    rotation: float
    veer: float


def draw_bias(noise: OdometryNoise, rng: np.random.Generator) -> WheelBias:
    """One run's wheels: three uniform draws, as Stage has them, so that none is off by more than 1.73 deviations."""
    radius, track, veer = math.sqrt(3.0) * rng.uniform(-1.0, 1.0, 3)
    off = noise.radius_sigma * radius
    return WheelBias(off, off - noise.track_sigma * track, noise.veer_sigma * veer)


def drifted(true: Trajectory, noise: OdometryNoise, bias: WheelBias, rng: np.random.Generator) -> Trajectory:
    """odom_from_base: the true path from its start, each step turned, stretched and turned again by its errors.

    Thrun, Burgard and Fox, Probabilistic Robotics (2005), table 5.6: a step is a rotation, a translation and a
    rotation; backward motion counts as a translation backwards. With all alphas and the bias 0 it is the true path
    exactly, as only the error is summed up. ``rng`` gives three draws a step whatever the alphas.
    """
    path = true.from_start()
    steps = np.diff(path.poses[:, :2], axis=0)
    turn1, length, turn2 = _decomposed(path, steps)
    draws = rng.standard_normal((len(steps), 3))
    way, turned = np.abs(length), np.abs(turn1) + np.abs(turn2)
    error1 = np.sqrt(noise.alpha1**2 * np.abs(turn1) + noise.alpha2**2 * way) * draws[:, 0]
    stretch = np.sqrt(noise.alpha3**2 * way + noise.alpha4**2 * turned) * draws[:, 1]
    error2 = np.sqrt(noise.alpha1**2 * np.abs(turn2) + noise.alpha2**2 * way) * draws[:, 2]
    error1 += bias.rotation * turn1 + bias.veer * length / 2.0
    stretch += bias.translation * way
    error2 += bias.rotation * turn2 + bias.veer * length / 2.0
    yaw_error = np.concatenate(([0.0], np.cumsum(error1 + error2)))
    believed = _turned(steps + stretch[:, None] * _directions(path, steps, way), yaw_error[:-1] + error1)
    poses = path.poses.copy()
    poses[1:, :2] += np.cumsum(believed - steps, axis=0)
    poses[:, 2] += yaw_error
    return Trajectory(path.stamps, poses)


def _decomposed(
    path: Trajectory, steps: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """How each step turns at first [rad], goes [m], backwards if negative, and turns at last [rad]: (N - 1,) each."""
    length = np.hypot(steps[:, 0], steps[:, 1])
    yaw = path.poses[:, 2]
    turn = _wrapped(np.diff(yaw))
    first = _wrapped(np.arctan2(steps[:, 1], steps[:, 0]) - yaw[:-1])
    backwards = (np.abs(first) > math.pi / 2.0) & (length > STANDING)
    first = np.where(backwards, _wrapped(first - math.pi), first)
    first = np.where(length > STANDING, first, 0.0)
    return first, np.where(backwards, -length, length), _wrapped(turn - first)


def _directions(path: Trajectory, steps: NDArray[np.float64], way: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where each step goes, as a unit vector; ahead, where it goes nowhere: (N - 1, 2)."""
    ahead = np.stack((np.cos(path.poses[:-1, 2]), np.sin(path.poses[:-1, 2])), axis=-1)
    return np.where(way[:, None] > STANDING, steps / np.maximum(way, STANDING)[:, None], ahead)


def _turned(vectors: NDArray[np.float64], angles: NDArray[np.float64]) -> NDArray[np.float64]:
    c, s = np.cos(angles), np.sin(angles)
    return np.stack((c * vectors[:, 0] - s * vectors[:, 1], s * vectors[:, 0] + c * vectors[:, 1]), axis=-1)


def _wrapped(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.arctan2(np.sin(angles), np.cos(angles))
