"""Recorded logs: cutting, thinning and interpolation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.robot.recorded_log import RateLimit, RecordedLog, covered_scans
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory


def recorded(stamps: list[float]) -> RecordedLog:
    scans = tuple(LidarScan(stamp, 0.0, 0.1, 0.0, 9.0, [1.0, 2.0]) for stamp in stamps)
    poses = Trajectory(stamps, np.column_stack((stamps, np.zeros((len(stamps), 2)))))
    return RecordedLog(RobotLog(scans, poses, SE2()), reference=poses)


@given(st.floats(0.5, 50.0), st.integers(0, 10**6), st.floats(0.0, 0.19))
def test_a_stream_of_the_greatest_rate_passes_whole_although_it_jitters(rate: float, seed: int, jitter: float) -> None:
    rng = np.random.default_rng(seed)
    stamps = (np.arange(200) + np.concatenate(([0.0], rng.uniform(-jitter, jitter, 199)))) / rate
    limit = RateLimit(rate)
    assert all(limit.is_due(stamp) for stamp in stamps.tolist())


@given(st.lists(st.floats(1e-3, 2.0), min_size=1, max_size=200), st.floats(0.5, 20.0))
def test_a_thinned_stream_is_no_denser_than_its_rate(steps: list[float], rate: float) -> None:
    stamps = np.cumsum(steps)
    limit = RateLimit(rate)
    kept = stamps[[limit.is_due(stamp) for stamp in stamps.tolist()]]
    for first in range(len(kept)):
        elapsed = kept[first:] - kept[first]
        assert (np.arange(len(elapsed)) <= elapsed * rate + 1.41).all()


def test_a_fast_stream_is_thinned_to_the_rate() -> None:
    thinned = recorded((np.arange(400) / 40.0).tolist()).thinned(10.0)
    np.testing.assert_allclose(np.diff(thinned.log.odometry.stamps), 0.1)
    assert thinned.reference is not None
    np.testing.assert_array_equal(thinned.reference.stamps, thinned.log.odometry.stamps)


def test_a_rate_that_is_not_positive_is_refused() -> None:
    with pytest.raises(ValueError, match="max_rate is 0, must be positive"):
        RateLimit(0.0)


def test_a_window_counts_from_the_first_scan() -> None:
    window = recorded([100.0, 101.0, 102.0, 103.0]).window(1.0, 2.0)
    np.testing.assert_array_equal(window.log.odometry.stamps, [101.0, 102.0])


def test_an_empty_window_is_refused() -> None:
    with pytest.raises(ValueError, match=r"no scan from 9 s to the end: the log lasts 3\.0 s"):
        recorded([100.0, 103.0]).window(9.0, None)


def test_interpolation_turns_the_shorter_way() -> None:
    trajectory = Trajectory([0.0, 2.0], [(0.0, 4.0, 3.0), (1.0, 2.0, -3.0)])
    between = trajectory.interpolated([0.0, 1.0, 2.0])
    np.testing.assert_allclose(between.poses[1], (0.5, 3.0, math.pi))
    np.testing.assert_allclose(np.exp(1j * between.poses[[0, 2], 2]), np.exp([3.0j, -3.0j]))


def test_interpolation_does_not_go_beyond_the_ends() -> None:
    with pytest.raises(ValueError, match=r"stamp 2\.5 s lies outside 0\.0 to 2\.0 s"):
        Trajectory([0.0, 2.0], np.zeros((2, 3))).interpolated([1.0, 2.5])


def test_scans_without_poses_are_refused_if_none_is_left() -> None:
    with pytest.raises(ValueError, match="cover no scan"):
        covered_scans([5.0, 6.0], Trajectory([0.0, 2.0], np.zeros((2, 3))))


@given(st.lists(st.floats(-2.0, 20.0, width=32) | st.just(math.nan) | st.just(math.inf), min_size=1, max_size=9))
def test_raw_readings_become_finite_ranges_or_infinities(readings: list[float]) -> None:
    scan = LidarScan.of_readings(0.0, 0.0, 0.1, 0.3, 10.0, readings)
    for reading, value in zip(readings, scan.ranges.tolist(), strict=True):
        if np.float32(0.3) <= reading < 10.0:
            assert value == reading
        else:
            assert value == (-math.inf if reading < 10.0 else math.inf)
