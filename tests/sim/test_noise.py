"""Noise on scans: exact at 0, of the right size at 1, and each component a stream of its own."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mapping.robot_log import RobotTruth
from mapping.se2 import SE2
from mapping.seeds import Role, stream
from mapping.trajectory import Trajectory
from sim.lidar import Lidar
from sim.mission import Mission
from sim.noise import Noise, Sensed, sense
from sim.odometry import OdometryNoise

QUIET = Noise.level(0.0)


def standing(distance: float, scans: int = 300, **lidar_fields: float) -> RobotTruth:
    """A robot that stands still and reads the same distance with each of 360 beams."""
    lidar = Lidar(**lidar_fields)
    stamps = np.arange(scans) / 10.0
    sweeps = tuple(lidar.scan(stamp, np.full(360, distance)) for stamp in stamps)
    trajectory = Trajectory(stamps, np.tile((3.0, 4.0, 0.5), (scans, 1)))
    return RobotTruth(sweeps, trajectory, np.zeros((scans, 360), dtype=bool), SE2())


def ranges(sensed: Sensed) -> np.ndarray:
    return np.array([scan.ranges for scan in sensed.log.scans])


def true_ranges(truth: RobotTruth) -> np.ndarray:
    return np.array([scan.ranges for scan in truth.scans])


def test_at_level_zero_the_log_is_the_truth_bit_for_bit(mission: Mission) -> None:
    for index, truth in enumerate(mission.robots):
        sensed = sense(truth, QUIET, seed=3, robot_index=index)
        assert np.array_equal(ranges(sensed), true_ranges(truth))
        assert np.array_equal(sensed.log.odometry.poses, truth.trajectory.from_start().poses)
        assert np.array_equal(sensed.log.odometry.stamps, truth.trajectory.stamps)
        assert sensed.log.base_from_lidar == truth.base_from_lidar
        assert not sensed.replaced.any()


@pytest.mark.parametrize("distance", [1.0, 8.0])
def test_range_errors_have_the_stated_deviation_and_no_bias(distance: float) -> None:
    noise = replace(QUIET, range_sigma=0.02, range_sigma_ratio=0.01)
    errors = ranges(sense(standing(distance), noise, 1, 0)).astype(float) - distance
    sigma = 0.02 + 0.01 * distance
    assert errors.std() == pytest.approx(sigma, rel=0.01)
    assert abs(errors.mean()) < 4.0 * sigma / math.sqrt(errors.size)
    lag_one = np.corrcoef(errors[:, :-1].ravel(), errors[:, 1:].ravel())[0, 1]
    assert abs(lag_one) < 0.02


def test_dropout_has_its_rate_and_is_marked() -> None:
    sensed = sense(standing(3.0), replace(QUIET, dropout=0.05), 1, 0)
    lost = np.isposinf(ranges(sensed))
    assert np.array_equal(lost, sensed.replaced)
    assert lost.mean() == pytest.approx(0.05, abs=4 * math.sqrt(0.05 * 0.95 / lost.size))


def test_a_beam_that_met_nothing_cannot_be_lost() -> None:
    sensed = sense(standing(math.inf), replace(QUIET, dropout=0.5), 1, 0)
    assert not sensed.replaced.any()
    assert np.isposinf(ranges(sensed)).all()


def test_readings_pushed_past_the_limits_become_infinite() -> None:
    noise = replace(QUIET, range_sigma=0.1)
    far = ranges(sense(standing(11.99), noise, 1, 0))
    near = ranges(sense(standing(0.16), noise, 1, 0))
    assert 0.3 < np.isposinf(far).mean() < 0.6
    assert far[np.isfinite(far)].max() <= 12.0
    assert 0.3 < np.isneginf(near).mean() < 0.6
    assert near[np.isfinite(near)].min() >= np.float32(0.15)


def test_errors_at_two_levels_differ_by_scale_alone(mission: Mission) -> None:
    truth = mission.robots[1]
    one, three = (sense(truth, replace(Noise.level(level), dropout=0.0), 4, 1) for level in (0.5, 1.5))
    true = true_ranges(truth).astype(float)
    both = np.isfinite(ranges(one)) & np.isfinite(ranges(three))
    errors = [ranges(each).astype(float)[both] - true[both] for each in (one, three)]
    assert np.allclose(3.0 * errors[0], errors[1], atol=1e-5)
    start = truth.trajectory.from_start().poses[:, 2]
    assert np.allclose(3.0 * (one.log.odometry.poses[:, 2] - start), three.log.odometry.poses[:, 2] - start)


def test_no_component_hears_of_anothers_level(mission: Mission) -> None:
    truth, usual = mission.robots[0], Noise()
    base = sense(truth, usual, 9, 0)

    other_range = sense(truth, replace(usual, range_sigma=0.2, range_sigma_ratio=0.0), 9, 0)
    assert np.array_equal(base.replaced, other_range.replaced)
    assert np.array_equal(base.log.odometry.poses, other_range.log.odometry.poses)

    other_dropout = sense(truth, replace(usual, dropout=0.3), 9, 0)
    assert np.array_equal(base.log.odometry.poses, other_dropout.log.odometry.poses)
    kept = ~other_dropout.replaced
    assert np.array_equal(ranges(base)[kept], ranges(other_dropout)[kept])
    assert not (base.replaced & ~other_dropout.replaced).any()

    other_odometry = sense(truth, replace(usual, odometry=OdometryNoise(1.0, 1.0, 1.0, 1.0)), 9, 0)
    assert np.array_equal(ranges(base), ranges(other_odometry))
    assert not np.array_equal(base.log.odometry.poses, other_odometry.log.odometry.poses)


def test_robots_and_seeds_have_noise_of_their_own() -> None:
    truth = standing(3.0, scans=5)
    base, other_robot, other_seed = (sense(truth, Noise(), seed, robot) for seed, robot in ((1, 0), (1, 1), (2, 0)))
    assert np.array_equal(ranges(base), ranges(sense(truth, Noise(), 1, 0)))
    assert not np.array_equal(ranges(base), ranges(other_robot))
    assert not np.array_equal(ranges(base), ranges(other_seed))


def test_sensing_leaves_the_mission_as_it_is(mission: Mission) -> None:
    before = [true_ranges(truth).copy() for truth in mission.robots]
    sense(mission.robots[0], Noise.level(3.0), 1, 0)
    assert all(np.array_equal(a, true_ranges(truth)) for a, truth in zip(before, mission.robots, strict=True))


def test_level_one_is_the_default_and_levels_multiply() -> None:
    assert Noise.level(1.0) == Noise()
    assert Noise.level(2.0).range_sigma == 2.0 * Noise().range_sigma
    assert Noise.level(2.0).odometry.alpha3 == 2.0 * Noise().odometry.alpha3
    assert Noise.level(1000.0).dropout == 1.0


@pytest.mark.parametrize("level", [-0.1, math.nan, math.inf])
def test_bad_levels_are_refused(level: float) -> None:
    with pytest.raises(ValueError, match=f"noise is {level}"):
        Noise.level(level)


@pytest.mark.parametrize(
    ("field", "value"), [("range_sigma", -1.0), ("range_sigma_ratio", math.nan), ("dropout", 1.5), ("dropout", -0.5)]
)
def test_bad_fields_are_refused_by_name_and_value(field: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        Noise(**{field: value})


def test_each_component_of_each_robot_opens_a_stream_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[tuple[int, Role, int]] = []

    def recorded(seed: int, role: Role, index: int = 0) -> np.random.Generator:
        opened.append((seed, role, index))
        return stream(seed, role, index)

    monkeypatch.setattr("sim.noise.stream", recorded)
    sense(standing(3.0, scans=5), Noise(), 7, 2)
    assert sorted(opened) == [(7, Role.RANGE_NOISE, 2), (7, Role.DROPOUT, 2), (7, Role.ODOMETRY_NOISE, 2)]
