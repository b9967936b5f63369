"""Simulate odometry: noise on each step, and a constant bias of the wheels."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from mapping.robot.trajectory import Trajectory

STANDING = 1e-6
"""Motions shorter than this [m] have no direction."""


LARGEST_NOISE = 10.0
"""Upper bound of every component, in its own unit: an error of ten metres per metre."""


@dataclass(frozen=True)
class OdometryNoise:
    """Hold the alphas of the odometry motion model and the wheel errors of a run, all as standard deviations.

    ``alpha1``: rotation from rotation; ``alpha2``: rotation from translation; ``alpha3``: translation from translation;
    ``alpha4``: translation from rotation. They hold for one metre or one radian of motion, and the variance grows in
    proportion to the motion. (In the book the deviation of each step is proportional to the step. Then the drift of a
    path depends on the number of steps, and a faster lidar would improve the odometry.)

    ``radius_sigma``: relative error of the radius of both wheels, which scales translation and rotation.
    ``track_sigma``: relative error of the track, which scales rotation. ``veer_sigma`` [rad/m]: apparent rotation while
    driving straight, which is the relative difference of the two radii over the track. Each run draws each error once.
    (Stage, model_position.cc, draws up to 1.5 % of translation and 2.5 % of rotation. Calibrated wheels are better by
    an order of magnitude: Borenstein and Feng, "UMBmark", 1995.)

    The defaults give an RMS error of 3 to 6 degrees of yaw and 1 to 2 % of the distance after 120 s of exploring an
    office. Raises ``ValueError`` with the field and its value.
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
        """Multiply all standard deviations by ``level``."""
        return OdometryNoise(*(level * getattr(self, each.name) for each in fields(self)))


@dataclass(frozen=True)
class WheelBias:
    """Hold the constant errors of one run: relative errors of translation and rotation, and a turn per
    metre [rad/m]."""

    translation: float
    rotation: float
    veer: float


def draw_bias(noise: OdometryNoise, rng: np.random.Generator) -> WheelBias:
    """Draw the wheel errors of one run from uniform distributions, as Stage does: none exceeds 1.73 deviations."""
    radius, track, veer = math.sqrt(3.0) * rng.uniform(-1.0, 1.0, 3)
    off = noise.radius_sigma * radius
    return WheelBias(off, off - noise.track_sigma * track, noise.veer_sigma * veer)


def simulate_odometry(true: Trajectory, noise: OdometryNoise, bias: WheelBias, rng: np.random.Generator) -> Trajectory:
    """Return odom_from_base: the true path from its start, with an error added to each step.

    Thrun, Burgard and Fox, Probabilistic Robotics (2005), table 5.6: a step is a rotation, a translation and a
    rotation. Backward motion counts as a negative translation. Only the errors are summed up, so without noise and bias
    the result equals the true path exactly. ``rng`` draws three numbers per step whatever the alphas.
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
    noisy_steps = _turned(steps + stretch[:, None] * _directions(path, steps, way), yaw_error[:-1] + error1)
    poses = path.poses.copy()
    poses[1:, :2] += np.cumsum(noisy_steps - steps, axis=0)
    poses[:, 2] += yaw_error
    return Trajectory(path.stamps, poses)


def _decomposed(
    path: Trajectory, steps: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Split each step into first rotation [rad], translation [m] (negative: backwards) and last rotation [rad], (N -
    1,) each."""
    length = np.hypot(steps[:, 0], steps[:, 1])
    yaw = path.poses[:, 2]
    turn = _wrapped(np.diff(yaw))
    first = _wrapped(np.arctan2(steps[:, 1], steps[:, 0]) - yaw[:-1])
    backwards = (np.abs(first) > math.pi / 2.0) & (length > STANDING)
    first = np.where(backwards, _wrapped(first - math.pi), first)
    first = np.where(length > STANDING, first, 0.0)
    return first, np.where(backwards, -length, length), _wrapped(turn - first)


def _directions(path: Trajectory, steps: NDArray[np.float64], way: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the unit direction of each step (N - 1, 2), the heading if the step has no length."""
    ahead = np.stack((np.cos(path.poses[:-1, 2]), np.sin(path.poses[:-1, 2])), axis=-1)
    return np.where(way[:, None] > STANDING, steps / np.maximum(way, STANDING)[:, None], ahead)


def _turned(vectors: NDArray[np.float64], angles: NDArray[np.float64]) -> NDArray[np.float64]:
    c, s = np.cos(angles), np.sin(angles)
    return np.stack((c * vectors[:, 0] - s * vectors[:, 1], s * vectors[:, 0] + c * vectors[:, 1]), axis=-1)


def _wrapped(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.arctan2(np.sin(angles), np.cos(angles))
