"""The beam model: sizes, rates, shapes, steps and limits."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from mapping.robot.scan import LidarScan
from sim.sensors.range_noise import RangeNoise, add_range_noise, range_draws

QUIET = RangeNoise().scaled(0.0)


def read(distance: float, noise: RangeNoise, scans: int = 300, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """What a lidar of 360 beams, 0.15 to 12 m, reads of a round room, and what the noise replaced, (scans, 360)."""
    scan = LidarScan(0.0, -math.pi, math.tau / 360, 0.15, 12.0, np.full(360, distance, np.float32))
    pairs = [
        add_range_noise(scan, noise, draws) for draws, _ in zip(range_draws(seed, 0, 360), range(scans), strict=False)
    ]
    return np.array([pair[0].ranges for pair in pairs], float), np.array([pair[1] for pair in pairs])


def rate_within(share: float, rate: float, count: int) -> bool:
    return abs(share - rate) < 4.0 * math.sqrt(rate * (1.0 - rate) / count)


@pytest.mark.parametrize("distance", [1.0, 8.0])
def test_range_errors_have_the_stated_deviation_and_no_bias(distance: float) -> None:
    errors = read(distance, replace(QUIET, range_sigma=0.02, range_sigma_ratio=0.01))[0] - distance
    sigma = 0.02 + 0.01 * distance
    assert errors.std() == pytest.approx(sigma, rel=0.01)
    assert abs(errors.mean()) < 4.0 * sigma / math.sqrt(errors.size)
    assert abs(np.corrcoef(errors[:, :-1].ravel(), errors[:, 1:].ravel())[0, 1]) < 0.02


def test_the_bias_of_a_device_is_constant() -> None:
    noise = replace(QUIET, bias_sigma=0.03, bias_sigma_ratio=0.01)
    at_two, at_eight = (read(distance, noise, scans=2)[0] - distance for distance in (2.0, 8.0))
    assert np.ptp(at_two) < 1e-6
    assert at_eight[0, 0] / at_two[0, 0] == pytest.approx(0.11 / 0.05, rel=1e-3)
    devices = np.array([read(2.0, noise, scans=1, seed=seed)[0][0, 0] - 2.0 for seed in range(400)])
    assert devices.std() == pytest.approx(0.05, rel=0.12)
    assert abs(devices.mean()) < 4.0 * 0.05 / 20.0


def test_dropout_has_its_rate_and_is_marked() -> None:
    ranges, replaced = read(3.0, replace(QUIET, dropout=0.05))
    assert np.array_equal(np.isposinf(ranges), replaced)
    assert rate_within(replaced.mean(), 0.05, replaced.size)


@pytest.mark.parametrize("mean", [0.5, 1e6])
def test_short_readings_are_exponential_up_to_the_true_range(mean: float) -> None:
    ranges, replaced = read(3.0, replace(QUIET, short=0.2, short_mean=mean))
    assert rate_within(replaced.mean(), 0.2, replaced.size)
    assert (ranges[~replaced] == 3.0).all()
    short = ranges[replaced]
    assert short.max() <= 3.0
    for at in (0.3, 1.0, 2.0):  # the truncated exponential's distribution function; below 0.15 m it is -inf
        assert rate_within((short <= at).mean(), math.expm1(-at / mean) / math.expm1(-3.0 / mean), short.size)


def test_short_readings_replace_missing_returns_but_not_too_close_ones() -> None:
    noise = replace(QUIET, short=1.0)
    assert (read(math.inf, noise, scans=20)[0] < 12.0).all()
    assert np.isneginf(read(-math.inf, noise, scans=2)[0]).all()


@pytest.mark.parametrize("distance", [3.0, math.inf])
def test_random_readings_are_uniform_within_the_limits(distance: float) -> None:
    ranges, replaced = read(distance, replace(QUIET, random=0.1))
    assert rate_within(replaced.mean(), 0.1, replaced.size)
    drawn = ranges[replaced]
    assert drawn.min() >= np.float32(0.15)
    assert drawn.max() <= 12.0
    histogram = np.histogram(drawn, 10, (0.15, 12.0))[0]
    assert ((histogram - drawn.size / 10) ** 2 / (drawn.size / 10)).sum() < 27.9  # chi squared, 9 degrees, p = 0.001


def test_lost_wins_over_random_and_random_over_short() -> None:
    everything = replace(QUIET, short=1.0, random=1.0, dropout=1.0)
    assert np.isposinf(read(3.0, everything, scans=2)[0]).all()
    assert read(3.0, replace(everything, dropout=0.0), scans=50)[0].max() > 11.0


def test_jitter_affects_slanted_walls() -> None:
    angles = -math.pi / 4 + np.arange(90) * math.radians(1.0)
    wall = LidarScan(0.0, angles[0], math.radians(1.0), 0.1, 30.0, (3.0 / np.cos(angles)).astype(np.float32))
    noise = replace(QUIET, angle_sigma=0.002)
    scans = zip(range_draws(1, 0, 90), range(2000), strict=False)
    errors = np.array([add_range_noise(wall, noise, draws)[0].ranges for draws, _ in scans]) - wall.ranges
    slope = 3.0 * np.sin(angles) / np.cos(angles) ** 2  # dr/da
    steep = slice(5, 30)
    assert errors[:, steep].std(axis=0) == pytest.approx(0.002 * np.abs(slope[steep]), rel=0.12)
    assert errors[:, 45].std() < 1e-4


@pytest.mark.parametrize("quantum", [0.001, 0.01, 0.25])
def test_all_readings_are_quantised(quantum: float) -> None:
    noise = replace(RangeNoise(), short=0.1, random=0.1, quantum=quantum)
    ranges = read(3.3, noise, scans=30)[0]
    steps = ranges[np.isfinite(ranges)] / quantum
    assert np.allclose(steps, np.rint(steps), atol=1e-6 * 12.0 / quantum)
    assert len(np.unique(np.rint(steps))) > 5
    assert read(3.3, replace(QUIET, quantum=quantum), 1)[0] == pytest.approx(round(3.3 / quantum) * quantum)


def test_quantisation_may_exceed_the_limits() -> None:
    assert np.isposinf(read(11.9, replace(QUIET, quantum=2.5), 1)[0]).all()
    assert np.isneginf(read(0.2, replace(QUIET, quantum=2.5), 1)[0]).all()


def test_readings_beyond_the_limits_become_infinite() -> None:
    noise = replace(QUIET, range_sigma=0.1)
    far, near = read(11.99, noise)[0], read(0.16, noise)[0]
    assert 0.3 < np.isposinf(far).mean() < 0.6
    assert far[np.isfinite(far)].max() <= 12.0
    assert 0.3 < np.isneginf(near).mean() < 0.6
    assert near[np.isfinite(near)].min() >= np.float32(0.15)


def test_a_beam_without_a_return_cannot_be_lost() -> None:
    ranges, replaced = read(math.inf, replace(QUIET, dropout=0.5), scans=3)
    assert not replaced.any()
    assert np.isposinf(ranges).all()


def test_levels_multiply_deviations_and_probabilities_but_not_the_quantum() -> None:
    usual = RangeNoise(0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.9, 0.1)
    twice = usual.scaled(2.0)
    for each in fields(RangeNoise):
        factor = 1.0 if each.name in ("quantum", "short_mean") else 2.0
        assert getattr(twice, each.name) == factor * getattr(usual, each.name), each.name
    many = usual.scaled(1000.0)
    assert (many.dropout, many.short, many.random) == (1.0, 1.0, 1.0)
    assert usual.scaled(1.0) == usual
    assert usual.scaled(0.0) == RangeNoise(*[0.0] * 8, 0.9, 0.0)


@pytest.mark.parametrize("field", [each.name for each in fields(RangeNoise)])
@pytest.mark.parametrize("value", [-0.5, math.nan, math.inf])
def test_bad_fields_are_refused_by_name_and_value(field: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        RangeNoise(**{field: value})


@pytest.mark.parametrize(("field", "value"), [("dropout", 1.5), ("short", 1.01), ("random", 2.0), ("short_mean", 0.0)])
def test_probabilities_above_one_and_a_mean_of_nothing_are_refused(field: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        RangeNoise(**{field: value})
