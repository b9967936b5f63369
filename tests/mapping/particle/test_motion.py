"""The motion model: exact without noise, and its covariance is that of its samples."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.particle.motion import motion_covariance, sample_motion
from mapping.particle.settings import MotionNoise

NONE = MotionNoise(0.0, 0.0, 0.0, 0.0)
METRES = st.floats(-3.0, 3.0)
ANGLES = st.floats(-3.1, 3.1)


@given(st.tuples(METRES, METRES, ANGLES), st.tuples(METRES, METRES, ANGLES))
def test_without_noise_a_motion_is_composed_with_the_pose(
    pose: tuple[float, float, float], motion: tuple[float, float, float]
) -> None:
    moved = sample_motion(np.array([pose]), SE2(*motion), NONE, np.random.default_rng(0))
    expected = SE2(*pose) @ SE2(*motion)
    assert moved[0, :2] == pytest.approx([expected.x, expected.y], abs=1e-6)
    assert math.remainder(moved[0, 2] - expected.yaw, math.tau) == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("motion", [SE2(0.5, 0.05, 0.2), SE2(-0.5, 0.1, -0.1), SE2(0.0, 0.0, 0.5)])
def test_the_covariance_is_that_of_the_samples(motion: SE2) -> None:
    noise = MotionNoise(0.05, 0.02, 0.05, 0.02)
    samples = sample_motion(np.zeros((200_000, 3)), motion, noise, np.random.default_rng(1))
    samples[:, 2] = np.arctan2(np.sin(samples[:, 2]), np.cos(samples[:, 2]))
    assert motion_covariance(motion, noise) == pytest.approx(np.cov(samples.T), rel=0.03, abs=3e-6)


def test_driving_backwards_is_not_two_half_turns() -> None:
    noise = MotionNoise(0.5, 0.0, 0.0, 0.0)
    moved = sample_motion(np.zeros((50, 3)), SE2(-1.0, 0.0, 0.0), noise, np.random.default_rng(2))
    assert moved == pytest.approx(np.tile([-1.0, 0.0, 0.0], (50, 1)))
