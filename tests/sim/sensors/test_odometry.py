"""Odometry drift against the step-by-step model, and its size."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import pytest

from mapping.geometry.se2 import SE2, wrap_angle
from mapping.robot.trajectory import Trajectory
from sim.sensors.odometry import STANDING, OdometryNoise, WheelBias, draw_bias, simulate_odometry

SOUND = WheelBias(0.0, 0.0, 0.0)
ALPHAS_ALONE = OdometryNoise(radius_sigma=0.0, track_sigma=0.0, veer_sigma=0.0)


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


def step_by_step(true: Trajectory, noise: OdometryNoise, bias: WheelBias, rng: np.random.Generator) -> list[SE2]:
    """Probabilistic Robotics, table 5.6, one step after another, with wheels that are off: the oracle."""
    estimated = [SE2()]
    for k, draw in enumerate(rng.standard_normal((len(true) - 1, 3))):
        step = true.pose(k).inverse() @ true.pose(k + 1)
        length = math.hypot(step.x, step.y)
        turn1 = math.atan2(step.y, step.x) if length > STANDING else 0.0
        forward = 1.0
        if abs(turn1) > math.pi / 2:
            turn1, forward = wrap_angle(turn1 - math.pi), -1.0
        turn2 = wrap_angle(step.yaw - turn1)
        veered = bias.veer * forward * length / 2
        noisy1 = (
            turn1 * (1 + bias.rotation)
            + veered
            + math.sqrt(noise.alpha1**2 * abs(turn1) + noise.alpha2**2 * length) * draw[0]
        )
        stretch = math.sqrt(noise.alpha3**2 * length + noise.alpha4**2 * (abs(turn1) + abs(turn2))) * draw[1]
        noisy2 = (
            turn2 * (1 + bias.rotation)
            + veered
            + math.sqrt(noise.alpha1**2 * abs(turn2) + noise.alpha2**2 * length) * draw[2]
        )
        reach = forward * (length * (1 + bias.translation) + stretch)
        estimated.append(estimated[-1] @ SE2(0, 0, noisy1) @ SE2(reach, 0, 0) @ SE2(0, 0, noisy2))
    return estimated


@pytest.mark.parametrize("bias", [SOUND, WheelBias(0.02, -0.03, 0.01)])
def test_the_errors_follow_the_odometry_motion_model(bias: WheelBias) -> None:
    true, noise = wandering(400), OdometryNoise(0.05, 0.04, 0.1, 0.03)
    fast = simulate_odometry(true, noise, bias, np.random.default_rng(8))
    slow = step_by_step(true, noise, bias, np.random.default_rng(8))
    for k in range(0, 401, 40):
        assert fast.poses[k, :2] == pytest.approx((slow[k].x, slow[k].y), abs=1e-6)
        assert wrap_angle(fast.poses[k, 2] - slow[k].yaw) == pytest.approx(0.0, abs=1e-6)


def test_without_noise_odometry_is_the_path_bit_for_bit() -> None:
    true = wandering(300)
    exact = simulate_odometry(true, OdometryNoise().scaled(0.0), SOUND, np.random.default_rng(1))
    assert np.array_equal(exact.poses, true.from_start().poses)


def test_odometry_starts_at_the_identity_and_does_not_drift_at_rest() -> None:
    standing = Trajectory(np.arange(50.0), np.tile((1.0, 2.0, 0.3), (50, 1)))
    for true in (standing, wandering(20)):
        poses = simulate_odometry(true, OdometryNoise(), WheelBias(0.01, 0.02, 0.03), np.random.default_rng(1)).poses
        assert np.allclose(poses if true is standing else poses[0], 0.0, atol=1e-12)


def final_errors(true: Trajectory, noise: OdometryNoise, runs: int = 300) -> np.ndarray:
    end = true.from_start().poses[-1]
    errors = []
    for seed in range(runs):
        bias = draw_bias(noise, np.random.default_rng((seed, 1)))
        errors.append(simulate_odometry(true, noise, bias, np.random.default_rng(seed)).poses[-1] - end)
    return np.array(errors)


def test_an_ordinary_robot_drifts_1_to_2_percent_and_3_to_6_degrees_in_120_s() -> None:
    true = wandering(1200)
    errors = final_errors(true, OdometryNoise())
    assert 3.0 < math.degrees(math.sqrt((errors[:, 2] ** 2).mean())) < 6.0
    assert 0.01 < math.sqrt((errors[:, :2] ** 2).sum(axis=1).mean()) / true.distance() < 0.02


def test_drift_is_independent_of_the_sampling_of_the_path() -> None:
    slow, fast = (final_errors(wandering(600, rate), ALPHAS_ALONE) for rate in (5, 40))
    assert np.allclose(slow.std(axis=0), fast.std(axis=0), rtol=0.2)


def straight(metres: float, steps: int, direction: float = 1.0) -> Trajectory:
    way = direction * np.linspace(0.0, metres, steps + 1)
    return Trajectory(np.arange(steps + 1.0), np.stack((way, 0.0 * way, 0.0 * way), axis=-1))


def turning(radians: float, steps: int) -> Trajectory:
    yaw = np.linspace(0.0, radians, steps + 1)
    return Trajectory(np.arange(steps + 1.0), np.stack((0.0 * yaw, 0.0 * yaw, yaw), axis=-1))


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_biased_wheels_scale_and_bend_straight_paths(direction: float) -> None:
    quiet, rng = OdometryNoise().scaled(0.0), np.random.default_rng(0)
    true = straight(10.0, 50, direction)
    assert simulate_odometry(true, quiet, WheelBias(0.01, 0.0, 0.0), rng).poses[-1] == pytest.approx(
        (10.1 * direction, 0, 0)
    )
    arc = simulate_odometry(true, quiet, WheelBias(0.0, 0.5, 0.02), rng).poses[-1]
    assert arc[2] == pytest.approx(0.2 * direction)
    assert arc[0] == pytest.approx(direction * math.sin(0.2) / 0.02, rel=1e-4)  # an arc of radius 50 m
    assert arc[1] == pytest.approx((1 - math.cos(0.2)) / 0.02, rel=1e-4)


def test_biased_wheels_scale_rotations() -> None:
    end = simulate_odometry(
        turning(-8.0, 40), OdometryNoise().scaled(0.0), WheelBias(0.1, 0.02, 0.3), np.random.default_rng(0)
    )
    assert end.poses[-1] == pytest.approx((0.0, 0.0, -8.16))


def test_wheel_errors_have_the_stated_deviations_and_are_bounded() -> None:
    noise = OdometryNoise(radius_sigma=0.004, track_sigma=0.003, veer_sigma=0.002)
    drawn = [draw_bias(noise, np.random.default_rng(seed)) for seed in range(4000)]
    translation, veer = np.array([each.translation for each in drawn]), np.array([each.veer for each in drawn])
    track = np.array([each.translation - each.rotation for each in drawn])
    for values, sigma in ((translation, 0.004), (track, 0.003), (veer, 0.002)):
        assert values.std() == pytest.approx(sigma, rel=0.05)
        assert abs(values.mean()) < 4.0 * sigma / math.sqrt(len(drawn))
        assert np.abs(values).max() <= math.sqrt(3.0) * sigma
    assert abs(np.corrcoef((translation, track, veer))[np.triu_indices(3, 1)]).max() < 0.07


@pytest.mark.parametrize("field", [each.name for each in fields(OdometryNoise)])
def test_bad_fields_are_refused_by_name_and_value(field: str) -> None:
    with pytest.raises(ValueError, match=rf"{field} is -0\.5"):
        OdometryNoise(**{field: -0.5})
