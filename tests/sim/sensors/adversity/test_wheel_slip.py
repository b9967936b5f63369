"""Wheels slip in turns alone, rarely, and sometimes by far."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.robot.trajectory import Trajectory
from sim.sensors.adversity.settings import Adversity
from sim.sensors.adversity.wheel_slip import add_slips, draw_slips

SLIPPERY = Adversity(slip=0.1)


def turning(radians: float, steps: int) -> Trajectory:
    yaw = np.linspace(0.0, radians, steps + 1)
    return Trajectory(np.arange(steps + 1.0), np.stack((0.0 * yaw, 0.0 * yaw, yaw), axis=-1))


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_straight_paths_have_no_slip() -> None:
    way = np.arange(1000.0)
    straight = Trajectory(way, np.stack((way, way, np.ones(1000)), axis=-1))
    assert not draw_slips(straight, Adversity(slip=1000.0), rng()).any()


def test_wheels_slip_as_often_as_stated_however_often_the_path_is_sampled() -> None:
    for steps in (20_000, 80_000):
        slips = draw_slips(turning(10_000.0, steps), SLIPPERY, rng())
        assert np.count_nonzero(slips) == pytest.approx(1000, rel=0.1)


def test_slips_add_to_the_turn_and_have_a_heavy_tail() -> None:
    slips = np.abs(draw_slips(turning(-200_000.0, 400_000), SLIPPERY, rng()))
    sizes = slips[slips > 0.0]
    assert (draw_slips(turning(-200.0, 400), SLIPPERY, rng()) <= 0.0).all()
    for size in (0.02, 0.05, 0.2):
        chance = (1.0 + size / SLIPPERY.slip_size) ** -SLIPPERY.slip_tail
        assert (sizes > size).mean() == pytest.approx(chance, rel=0.1)
    # A normal distribution of that deviation would not reach ten deviations once in 1e23.
    assert sizes.max() > 10.0 * sizes.std()


def test_the_draws_do_not_depend_on_the_settings_and_more_slip_more_often() -> None:
    true, generators = turning(500.0, 1000), [rng(1), rng(1), rng(1)]
    none, few, many = (
        draw_slips(true, Adversity(slip=amount), one) for amount, one in zip((0.0, 0.1, 0.5), generators, strict=True)
    )
    assert len({one.random() for one in generators}) == 1
    assert not none.any()
    assert np.array_equal(few, np.where(few != 0.0, many, 0.0))
    assert np.count_nonzero(few) < np.count_nonzero(many)


def test_a_slip_turns_the_rest_of_the_path() -> None:
    steps = [SE2(1.0, 0.0, 0.0), SE2(1.0, 0.2, 0.3), SE2(1.0, 0.0, -0.1), SE2(0.5, 0.0, 0.0)]
    slips = np.array((0.0, math.pi / 2.0, 0.0, -0.2))
    poses, turned = [SE2(0.3, 0.1, 0.4)], [SE2(0.3, 0.1, 0.4)]
    for step, slip in zip(steps, slips, strict=True):
        poses.append(poses[-1] @ step)
        turned.append(turned[-1] @ step @ SE2(0.0, 0.0, slip))
    path, expected = (
        Trajectory(np.arange(5.0), np.array([(p.x, p.y, p.yaw) for p in each])) for each in (poses, turned)
    )
    assert add_slips(path, slips).poses == pytest.approx(expected.poses)
    assert add_slips(path, np.zeros(4)) is path
