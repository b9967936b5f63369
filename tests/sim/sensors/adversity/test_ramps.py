"""A tilted lidar hits the floor downhill, and walls at a slant."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sim.sensors.adversity.ramps import Ramps, tilted_ranges


def test_a_tilted_beam_is_longer_uphill_and_ends_on_the_floor_downhill() -> None:
    slope = math.radians(30.0)
    ranges, on_floor = tilted_ranges(np.full(4, 3.0), np.radians((0.0, 90.0, 180.0, -90.0)), slope, 0.5)
    # Uphill 3 / cos 30; across level; downhill the floor is 0.5 / sin 30 away.
    assert ranges == pytest.approx((3.0 / math.cos(slope), 3.0, 1.0, 3.0))
    assert on_floor.tolist() == [False, False, True, False]


def test_a_near_wall_is_hit_before_the_floor() -> None:
    ranges, on_floor = tilted_ranges(np.array([0.8]), np.array([math.pi]), math.radians(30.0), 0.5)
    assert ranges[0] == pytest.approx(0.8 / math.cos(math.radians(30.0)))
    assert not on_floor[0]


def test_beams_without_a_return_find_the_floor_downhill_alone() -> None:
    angles = np.radians((0.0, 180.0))
    ranges, on_floor = tilted_ranges(np.full(2, np.inf), angles, math.radians(5.0), 0.5)
    assert ranges == pytest.approx((math.inf, 0.5 / math.sin(math.radians(5.0))))
    assert on_floor.tolist() == [False, True]


def test_the_steeper_and_the_lower_the_shorter() -> None:
    angles = np.linspace(-math.pi, math.pi, 91)
    level = np.full(91, 12.0)
    floors = [
        tilted_ranges(level, angles, slope, height)[1].sum()
        for slope, height in ((0.0, 0.5), (0.05, 0.5), (0.1, 0.5), (0.1, 0.2))
    ]
    assert floors == sorted(set(floors))
    assert np.array_equal(tilted_ranges(level, angles, 0.0, 0.5)[0], level)


def test_only_a_robot_on_a_ramp_is_tilted() -> None:
    ramps = Ramps(np.array([(2.0, 2.0), (3.0, 2.0)]), np.array([0.5, 1.5]), 1.0)
    assert ramps.uphill_at(np.array((2.2, 2.0))) == 0.5
    assert ramps.uphill_at(np.array((2.8, 2.0))) == 1.5
    assert ramps.uphill_at(np.array((2.0, 3.01))) is None
    assert Ramps(np.empty((0, 2)), np.empty(0), 1.0).uphill_at(np.array((2.0, 2.0))) is None
