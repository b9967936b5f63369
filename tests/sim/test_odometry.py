"""Odometry drift against the step-by-step model, and its size."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.se2 import SE2, wrap_angle
from mapping.trajectory import Trajectory
from sim.odometry import STANDING, OdometryNoise, drifted


def wandering(steps: int, rate: int = 10) -> Trajectory:
    """A path like an explorer's: 0.5 m/s on arcs that change, with turns on the spot and some reversing."""
    time = np.arange(steps * rate // 10 + 1) / rate
    poses = [SE2(2.0, 3.0, 1.0)]
    for t in time[:-1]:
        speed, turn = ((0.5, 0.4 * math.sin(t / 3)), (0.0, 0.45), (-0.15, 0.2))[
            0 if t % 20 < 15 else 1 + int(t % 20 >= 19)
        ]
        poses.append(poses[-1] @ SE2(speed / rate, 0.0, turn / rate))
    return Trajectory(time, np.array([(pose.x, pose.y, pose.yaw) for pose in poses]))


def step_by_step(true: Trajectory, noise: OdometryNoise, rng: np.random.Generator) -> list[SE2]:
    """Probabilistic Robotics, table 5.6, one step after another: the oracle."""
    believed = [SE2()]
    for k, draw in enumerate(rng.standard_normal((len(true) - 1, 3))):
        step = true.pose(k).inverse() @ true.pose(k + 1)
        length = math.hypot(step.x, step.y)
        turn1 = math.atan2(step.y, step.x) if length > STANDING else 0.0
        forward = 1.0
        if abs(turn1) > math.pi / 2:
            turn1, forward = wrap_angle(turn1 - math.pi), -1.0
        turn2 = wrap_angle(step.yaw - turn1)
        noisy1 = turn1 + math.sqrt(noise.alpha1**2 * abs(turn1) + noise.alpha2**2 * length) * draw[0]
        stretch = math.sqrt(noise.alpha3**2 * length + noise.alpha4**2 * (abs(turn1) + abs(turn2))) * draw[1]
        noisy2 = turn2 + math.sqrt(noise.alpha1**2 * abs(turn2) + noise.alpha2**2 * length) * draw[2]
        reach = forward * length + (stretch if forward > 0 else -stretch)
        believed.append(believed[-1] @ SE2(0, 0, noisy1) @ SE2(reach, 0, 0) @ SE2(0, 0, noisy2))
    return believed


def test_it_is_the_odometry_motion_model() -> None:
    true, noise = wandering(400), OdometryNoise(0.05, 0.04, 0.1, 0.03)
    fast = drifted(true, noise, np.random.default_rng(8))
    slow = step_by_step(true, noise, np.random.default_rng(8))
    for k in range(0, 401, 40):
        assert fast.poses[k, :2] == pytest.approx((slow[k].x, slow[k].y), abs=1e-6)
        assert wrap_angle(fast.poses[k, 2] - slow[k].yaw) == pytest.approx(0.0, abs=1e-6)


def test_without_noise_it_is_the_path_from_its_start_bit_for_bit() -> None:
    true = wandering(300)
    exact = drifted(true, OdometryNoise(0.0, 0.0, 0.0, 0.0), np.random.default_rng(1))
    assert np.array_equal(exact.poses, true.from_start().poses)


def test_it_starts_at_the_identity_and_a_standing_robot_does_not_drift() -> None:
    standing = Trajectory(np.arange(50.0), np.tile((1.0, 2.0, 0.3), (50, 1)))
    for true in (standing, wandering(20)):
        poses = drifted(true, OdometryNoise(), np.random.default_rng(1)).poses
        assert np.allclose(poses if true is standing else poses[0], 0.0, atol=1e-12)


def final_errors(true: Trajectory, noise: OdometryNoise, runs: int = 300) -> np.ndarray:
    end = true.from_start().poses[-1]
    return np.array([drifted(true, noise, np.random.default_rng(seed)).poses[-1] - end for seed in range(runs)])


def test_a_decent_robot_drifts_1_to_2_percent_and_3_to_6_degrees_in_120_s() -> None:
    true = wandering(1200)
    errors = final_errors(true, OdometryNoise())
    assert 3.0 < math.degrees(math.sqrt((errors[:, 2] ** 2).mean())) < 6.0
    assert 0.01 < math.sqrt((errors[:, :2] ** 2).sum(axis=1).mean()) / true.distance() < 0.02


def test_drift_does_not_depend_on_how_finely_the_path_is_cut() -> None:
    slow, fast = (final_errors(wandering(600, rate), OdometryNoise()) for rate in (5, 40))
    assert np.allclose(slow.std(axis=0), fast.std(axis=0), rtol=0.2)


@pytest.mark.parametrize("field", ["alpha1", "alpha2", "alpha3", "alpha4"])
def test_bad_alphas_are_refused_by_name_and_value(field: str) -> None:
    with pytest.raises(ValueError, match=rf"{field} is -0\.5"):
        OdometryNoise(**{field: -0.5})
