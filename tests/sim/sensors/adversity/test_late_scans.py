"""A late scan gets the pose of a later moment."""

from __future__ import annotations

import numpy as np
import pytest

from mapping.robot.trajectory import Trajectory
from sim.sensors.adversity.late_scans import delay_scans, draw_delays
from sim.sensors.adversity.settings import Adversity

STAMPS = np.arange(11) * 0.1


def starting(speed: float, turn_rate: float) -> Trajectory:
    """A path that stands still for 0.5 s, and then drives and turns."""
    moved = np.maximum(0.0, STAMPS - 0.5)
    return Trajectory(STAMPS, np.stack((speed * moved, 0.0 * moved, turn_rate * moved), axis=-1))


def test_at_half_a_metre_per_second_a_tenth_of_a_second_is_five_centimetres() -> None:
    path = starting(0.5, 1.0)
    error = delay_scans(path, np.full(11, 0.1)).poses - path.poses
    assert error[:5] == pytest.approx(np.zeros((5, 3)))
    assert error[5:10] == pytest.approx(np.tile((0.05, 0.0, 0.1), (5, 1)))
    assert error[10] == pytest.approx((0.0, 0.0, 0.0))  # the robot stands still after the last scan


def test_poses_between_stamps_are_interpolated_the_shorter_way_round() -> None:
    turning = Trajectory(np.arange(3.0), np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 3.1), (1.0, 0.0, -3.1)]))
    late = delay_scans(turning, np.array((0.0, 0.5, 0.0)))
    assert late.poses[1] == pytest.approx((0.5, 0.0, np.pi))


def test_delays_are_never_below_the_latency_and_exceed_it_by_the_mean_jitter() -> None:
    delays = draw_delays(20_000, Adversity(latency=0.2, jitter=0.05), np.random.default_rng(0))
    assert delays.min() >= 0.2
    assert delays.mean() == pytest.approx(0.25, abs=0.002)


def test_without_delay_the_odometry_is_returned() -> None:
    path = starting(0.5, 1.0)
    assert delay_scans(path, draw_delays(11, Adversity(), np.random.default_rng(0))) is path
