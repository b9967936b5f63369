"""The tests of a loop, each in a scene that it alone refuses: without it the loop would be accepted."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.robot.scan import LidarScan
from mapping.slam.correlation import correlate, likelihood_field, peaks, search_angles
from mapping.slam.loops.registration import Candidate, register, sub_map
from mapping.slam.settings import LoopSettings, SlamSettings
from mapping.slam.tracking.points import RangeDeviation, scan_points
from tests.mapping.slam.rooms import box, cast

EXACT = RangeDeviation(0.01, 0.003)
OFF = {"min_submap_overlap": 0.0, "min_agreement": 0.0, "max_runner_up": 1e9}
OFF |= {"max_position_deviation": 1e9}


def scans_along(walls, poses, range_max=12.0):
    """Return the sub-map of a robot at poses (N, 3), in the frame of the middle one."""
    points = []
    for pose in poses:
        ranges = cast(walls, pose, range_max=range_max)
        scan = LidarScan(0.0, -math.pi, math.tau / ranges.size, 0.0, range_max, ranges.astype(np.float32))
        points.append(scan_points(scan, SE2(), EXACT, SlamSettings().points))
    return sub_map(range(len(poses)), len(poses) // 2, poses.__getitem__, points.__getitem__, np.zeros(3))


def straight(x0, x1, y, count=5):
    return np.stack([np.linspace(x0, x1, count), np.full(count, y), np.zeros(count)], axis=1)


def loop_of(target, query, predicted, deviations, **changes):
    loops = dataclasses.replace(LoopSettings(), **changes)
    settings = dataclasses.replace(SlamSettings(), loops=loops)
    candidate = Candidate(0, 9, np.array(predicted), np.diag(np.square(deviations)))
    return register(query, target, candidate, 0.1, 1.0, settings)


def corridor(period=None, length=30.0):
    """Return a corridor 2 m wide, with equal niches every ``period`` metres."""
    walls = [box(-5.0, 0.0, length, 2.0)]
    if period is not None:
        walls += [box(x, 1.6, x + 0.5, 2.0) for x in np.arange(-4.0, length, period)]
    return np.vstack(walls)


ROOM = np.vstack((box(0.0, 0.0, 6.0, 4.0), box(1.0, 1.0, 1.6, 1.4), box(4.0, 2.9, 4.8, 3.3)))


def test_a_true_loop_passes_every_test_and_finds_the_pose():
    target, query = scans_along(ROOM, straight(2.0, 3.0, 2.0)), scans_along(ROOM, straight(2.6, 3.8, 1.8))
    loop = loop_of(target, query, (0.3, 0.3, 0.1), (0.3, 0.3, 0.1))
    assert loop.refused is None
    assert loop.link.relative == pytest.approx([0.7, -0.2, 0.0], abs=0.01)  # 3.2, 1.8 seen from 2.5, 2.0


def test_equal_niches_are_refused_by_the_runner_up():
    walls = corridor(period=2.0)
    target, query = (
        scans_along(walls, straight(9.0, 10.0, 1.0), 3.5),
        scans_along(walls, straight(12.0, 13.0, 1.0), 3.5),
    )
    place = (1.0, 0.0, 0.0), (1.0, 0.1, 0.05)  # truly 3 m ahead; 1 m looks the same
    assert loop_of(target, query, *place).refused == "runner_up"
    accepted = loop_of(target, query, *place, max_runner_up=1e9)
    assert accepted.refused is None
    assert accepted.link.relative[0] % 2.0 == pytest.approx(1.0, abs=0.05)


def test_a_room_that_was_seen_through_is_refused_by_the_agreement():
    beyond = np.array([(9.0, 0.0, 9.0, 8.0), (9.0, 8.0, 0.0, 8.0)])
    open_room = np.vstack((ROOM[[0, 3]], ROOM[4:], beyond))  # two walls are farther away
    target, query = scans_along(ROOM, straight(2.0, 3.0, 2.0)), scans_along(open_room, straight(2.0, 3.0, 2.0))
    place = (0.1, 0.0, 0.0), (0.2, 0.2, 0.05)
    assert loop_of(target, query, *place).refused == "agreement"
    assert loop_of(target, query, *place, min_agreement=0.0).refused is None


def test_a_small_common_part_is_refused_by_the_overlap():
    hall = np.vstack((box(-20.0, -20.0, 20.0, 20.0), box(5.0, 0.0, 5.6, 3.0), box(8.0, -6.0, 9.0, -2.0)))
    target, query = scans_along(hall, straight(0.0, 0.4, 0.0), 6.5), scans_along(hall, straight(10.0, 10.4, -1.0), 6.5)
    place = (10.0, -1.0, 0.0), (0.2, 0.2, 0.05)
    loop = loop_of(target, query, *place, **OFF)
    assert loop is None or loop.evidence.overlap < LoopSettings().min_submap_overlap


def test_a_blank_corridor_closes_no_loop():
    walls = np.array([(-50.0, 0.0, 50.0, 0.0), (50.0, 2.0, -50.0, 2.0)])
    target, query = scans_along(walls, straight(0.0, 1.0, 1.0), 5.0), scans_along(walls, straight(2.0, 3.0, 1.0), 5.0)
    loop = loop_of(target, query, (2.0, 0.0, 0.0), (0.5, 0.1, 0.05))
    assert loop is None or loop.refused in ("position_deviation", "runner_up")


def test_the_correlation_is_the_mean_of_the_looked_up_likelihoods():
    rng = np.random.default_rng(0)
    walls, points = rng.uniform(-3.0, 3.0, (60, 2)), rng.uniform(-2.0, 2.0, (25, 2))
    field = likelihood_field(walls, 0.1, 0.1, 1.0)
    angles = search_angles(0.3, 0.1)
    scores = correlate(field, points, np.array([0.2, -0.1, 0.4]), 0.3, angles)
    for a, r, q in ((0, 0, 0), (3, 3, 3), (6, 2, 5)):
        moved = SE2(0.2, -0.1, 0.4 + angles[a]).apply(points)
        cells = np.floor((moved - (field.x, field.y)) / 0.1).astype(int) + np.array([q - 3, r - 3])
        inside = ((cells >= 0) & (cells < field.likelihood.shape[::-1])).all(axis=1)
        expected = field.likelihood[cells[inside, 1], cells[inside, 0]].sum() / len(points)
        assert scores[a, r, q] == pytest.approx(expected, abs=1e-5)


def test_peaks_are_apart_and_in_order():
    rng = np.random.default_rng(1)
    angles = search_angles(0.5, 0.1)
    found = peaks(rng.random((angles.size, 21, 21)).astype(np.float32), 0.2, angles, (0.8, 0.17), 6)
    scores = [score for score, _ in found]
    assert scores == sorted(scores, reverse=True)
    for k, (_, one) in enumerate(found):
        for _, other in found[:k]:
            assert math.hypot(*(one - other)[:2]) >= 0.8 - 1e-9 or abs(one[2] - other[2]) >= 0.17 - 1e-9
