"""The steps of tracking: points with normals, surfels, and the match of a scan to them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.robot.scan import LidarScan
from mapping.slam.settings import SlamSettings
from mapping.slam.tracking.matching import match_scan
from mapping.slam.tracking.motion import OdometryLevel, motion_covariance
from mapping.slam.tracking.points import RangeDeviation, range_deviation, scan_points
from mapping.slam.tracking.surfels import surfel_map
from tests.mapping.slam.rooms import cast, log_of, office

SETTINGS = SlamSettings()
EXACT = RangeDeviation(0.01, 0.003)
WEAK = np.diag([1e-3, 1e-3, 1e-3])


def scan_at(pose, walls=None):
    ranges = cast(office() if walls is None else walls, np.asarray(pose, float))
    return LidarScan(0.0, -math.pi, math.tau / ranges.size, 0.0, 12.0, ranges.astype(np.float32))


def surfels_at(pose):
    points = scan_points(scan_at(pose), SE2(), EXACT, SETTINGS.points)
    place = SE2(*pose)
    turned = SE2(yaw=pose[2])
    return surfel_map(place.apply(points.points), turned.apply(points.normals), 0.1, SETTINGS.local_map)


def test_normals_of_a_wall_point_at_the_lidar():
    points = scan_points(scan_at((1.0, 1.0, 0.3)), SE2(), EXACT, SETTINGS.points)
    assert np.hypot(*points.normals.T) == pytest.approx(np.ones(len(points.normals)))
    assert (np.sum(points.normals * -points.points, axis=1) > 0.0).all()
    world = SE2(yaw=0.3).apply(points.normals)
    straight = np.abs(world).max(axis=1) > 0.999  # all walls are parallel to an axis; corners are rounded
    assert straight.mean() > 0.85


def test_points_lie_where_the_mounting_puts_the_lidar():
    mount = SE2(0.2, -0.1, math.pi / 2)
    moved = scan_points(scan_at((1.0, 1.0, 0.0)), mount, EXACT, SETTINGS.points)
    plain = scan_points(scan_at((1.0, 1.0, 0.0)), SE2(), EXACT, SETTINGS.points)
    assert moved.points == pytest.approx(mount.apply(plain.points))


@pytest.mark.parametrize("noise", [0.02, 0.06])
def test_the_noise_of_the_ranges_is_found_in_the_log(noise):
    poses = np.stack([np.linspace(1.0, 4.0, 60), np.full(60, 2.0), np.zeros(60)], axis=1)
    log, _ = log_of(office(), poses, noise=noise, seed=1)
    deviation = range_deviation(log.scans, SETTINGS.points)
    assert deviation.at(4.0) == pytest.approx(noise, rel=0.35)


@settings(max_examples=25, deadline=None)
@given(
    st.floats(0.5, 4.0), st.floats(0.5, 2.5), st.floats(-3.0, 3.0), st.floats(-0.15, 0.15), st.floats(-0.15, 0.15),
    st.floats(-0.08, 0.08),
)  # fmt: skip
def test_a_match_returns_the_true_pose_from_a_wrong_guess(x, y, yaw, dx, dy, turn):
    surfels = surfels_at((1.0, 1.0, 0.0))
    scan = scan_points(scan_at((1.3, 1.2, 0.2)), SE2(), EXACT, SETTINGS.points)
    guess = np.array([1.3 + dx, 1.2 + dy, 0.2 + turn])
    match = match_scan(scan, surfels, guess, (guess, WEAK), SETTINGS.match)
    assert match.pose == pytest.approx([1.3, 1.2, 0.2], abs=0.012)
    moved = SE2(x, y, yaw)  # the same in another frame
    points = scan_points(scan_at((1.0, 1.0, 0.0)), SE2(), EXACT, SETTINGS.points)
    placed = moved @ SE2(1.0, 1.0, 0.0)
    turned = surfel_map(placed.apply(points.points), SE2(yaw=placed.yaw).apply(points.normals), 0.1, SETTINGS.local_map)
    other = moved @ SE2(*guess)
    start = np.array([other.x, other.y, other.yaw])
    again = match_scan(scan, turned, start, (start, WEAK), SETTINGS.match)
    true = moved @ SE2(1.3, 1.2, 0.2)
    assert again.pose[:2] == pytest.approx([true.x, true.y], abs=0.012)
    assert math.remainder(again.pose[2] - true.yaw, math.tau) == pytest.approx(0.0, abs=0.006)


def test_along_a_single_wall_the_prediction_decides():
    """A match with few points loses to odometry where the points say nothing."""
    wall = np.array([(-50.0, 2.0, 50.0, 2.0)])
    points = scan_points(scan_at((0.0, 0.0, 0.0), wall), SE2(), EXACT, SETTINGS.points)
    surfels = surfel_map(points.points, points.normals, 0.1, SETTINGS.local_map)
    predicted = np.array([0.3, 0.05, 0.0])
    prior = np.diag([1 / 0.02**2, 1 / 0.02**2, 1 / 0.01**2])
    match = match_scan(points, surfels, predicted, (predicted, prior), SETTINGS.match)
    assert match.pose[0] == pytest.approx(0.3, abs=0.005)  # along the wall: the prediction
    assert match.pose[1] == pytest.approx(0.0, abs=0.005)  # across: the scan


@settings(max_examples=20, deadline=None)
@given(st.floats(0.1, 5.0), st.floats(0.0, 6.0), st.floats(1.01, 3.0))
def test_the_prediction_grows_less_certain_with_the_path(distance, turn, factor):
    near, far = (np.diag(motion_covariance(k * distance, k * turn, SETTINGS.motion)) for k in (1.0, factor))
    assert (far > near).all()


@pytest.mark.parametrize("level", [1.0, 3.0, 8.0])
def test_the_level_of_the_odometry_is_found_from_its_errors(level):
    rng = np.random.default_rng(3)
    estimate = OdometryLevel(SETTINGS.motion)
    unit, measured = np.array([1e-4, 1e-4, 1e-5]), np.array([1e-6, 1e-6, 1e-7])
    for _ in range(60):
        difference = rng.standard_normal(3) * np.sqrt(level**2 * unit + measured)
        if rng.random() < 0.1:
            difference *= 20.0  # a slip
        estimate.add(difference, unit, measured)
    assert estimate.level == pytest.approx(level, rel=0.3)
