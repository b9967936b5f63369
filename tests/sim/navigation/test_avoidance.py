"""Steering: towards the target, away from obstacles."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sim.navigation.avoidance import Avoidance
from sim.navigation.settings import SteeringSettings
from sim.physics.drive import DriveLimits

LIMITS = DriveLimits()
NOTHING = np.empty((0, 2))


def positions(speed: float, turn: float) -> np.ndarray:
    """Where the command leads from rest within the horizon, stepped finely: the oracle of the roll-outs."""
    poses, yaw, step, velocity = [np.zeros(2)], 0.0, SteeringSettings.horizon / 2000, (0.0, 0.0)
    for _ in range(2000):
        velocity = LIMITS.ramp(velocity, (speed, turn), step)
        yaw += velocity[1] * step
        poses.append(poses[-1] + velocity[0] * step * np.array((math.cos(yaw), math.sin(yaw))))
    return np.array(poses)


def test_the_robot_drives_straight_to_a_target_ahead_and_turns_to_one_beside() -> None:
    steering = Avoidance(LIMITS, radius=0.2)
    assert steering.steer(np.array((2.0, 0.0)), NOTHING) == pytest.approx((LIMITS.speed, 0.0))
    assert steering.steer(np.array((0.3, 2.0)), NOTHING)[1] > 0.0
    assert steering.steer(np.array((0.3, -2.0)), NOTHING)[1] < 0.0
    assert abs(steering.steer(np.array((-2.0, 0.1)), NOTHING)[1]) > 0.5


def test_no_command_approaches_an_obstacle_within_the_horizon() -> None:
    rng = np.random.default_rng(2)
    steering = Avoidance(LIMITS, radius=0.2)
    for _ in range(60):
        seen = rng.uniform(-1.5, 1.5, (30, 2))
        seen = seen[np.hypot(*seen.T) > 0.2 + SteeringSettings.hull_margin + 0.02]
        speed, turn = steering.steer(rng.uniform(-1.0, 1.0, 2), seen)
        assert -LIMITS.speed <= speed <= LIMITS.speed
        assert abs(turn) <= LIMITS.turn_rate
        gap = np.hypot(*(positions(speed, turn)[:, None] - seen).transpose(2, 0, 1)).min()
        assert (
            gap > 0.2 + SteeringSettings.hull_margin - 0.03
        )  # between two samples of a motion, 0.14 m apart, a little is lost


def test_a_robot_that_stands_too_near_backs_off() -> None:
    wall = np.stack((np.full(41, 0.22), np.linspace(-1.0, 1.0, 41)), axis=-1)
    speed, _ = Avoidance(LIMITS, radius=0.2).steer(np.array((2.0, 0.0)), wall)
    assert speed < 0.0


def test_the_target_is_the_last_visible_point_of_the_path() -> None:
    post = np.array([(0.5, 0.0)])
    path = np.array([(0.1, 0.1), (0.2, 0.3), (0.4, 0.5), (0.7, 0.3), (0.9, 0.0)])
    steering = Avoidance(LIMITS, radius=0.2)
    assert steering.choose_target(path, post).tolist() == [0.4, 0.5]
    assert steering.choose_target(path, NOTHING).tolist() == [0.9, 0.0]


@pytest.mark.parametrize(("field", "value"), [("speed", 0.0), ("speed", math.nan), ("turn_rate", -1.0)])
def test_bad_limits_are_refused_by_name_and_value(field: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        DriveLimits(**{field: value})
