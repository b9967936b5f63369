"""SLAM as a whole, in worlds of straight walls whose truth is known."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from mapping.robot.trajectory import Trajectory
from mapping.slam.front_end import FRONT_ENDS
from mapping.slam.pipeline import online_poses, slam
from mapping.slam.settings import POSES, TRUE_POSES, SlamSettings
from tests.mapping.slam.rooms import along, log_of, office, path_error, ring_corridor

ROUND = np.array([(1.0, 1.0), (15.0, 1.0), (15.0, 15.0), (1.0, 15.0), (1.0, 1.0), (7.0, 1.0)])


@pytest.fixture(scope="module")
def corridor():
    """A corridor driven once around and a little farther, with poor odometry."""
    return log_of(ring_corridor(), along(ROUND, speed=0.1), noise=0.03, odometry_noise=2.0, seed=4)


@pytest.fixture(scope="module")
def solved(corridor):
    return slam(corridor[0])


def test_the_trajectory_is_much_better_than_odometry(corridor, solved):
    log, true = corridor
    odometry = path_error(log.odometry, true)
    assert odometry > 0.3
    assert path_error(solved.trajectory, true) < 0.1 * odometry


def test_the_round_is_closed_by_loops_of_the_true_place(corridor, solved):
    _, true = corridor
    assert solved.loops
    for edge in solved.loops:
        first, second = (true.pose(solved.keyframes[k]) for k in (edge.first, edge.second))
        off = (first.inverse() @ second).inverse() @ edge.first_from_second
        assert math.hypot(off.x, off.y) < 0.3
        assert abs(off.yaw) < 0.05


def test_the_covariances_of_edges_fit_their_errors(corridor, solved):
    """The mean normalised squared error of three degrees of freedom lies near 3."""
    _, true = corridor
    values = []
    for edge in solved.edges:
        first, second = (true.pose(solved.keyframes[k]) for k in (edge.first, edge.second))
        off = ((first.inverse() @ second) @ edge.first_from_second.inverse()).log()
        values.append(off @ np.linalg.solve(edge.covariance, off) / 3.0)
    assert 0.1 < np.mean(values) < 3.0


def test_online_poses_stay_until_a_loop_closes_and_end_near_those_of_the_whole_log(corridor, solved):
    log, true = corridor
    moved, before = [], np.zeros((0, 3))
    for k, poses in enumerate(online_poses(log)):
        assert poses.shape == (k + 1, 3)
        assert poses[0] == pytest.approx(np.zeros(3), abs=1e-9)
        moved.append(np.abs(poses[:k] - before).max(initial=0.0))
        before = poses
    loops = np.flatnonzero(np.array(moved) > 1e-9)
    first_loop = min(solved.keyframes[edge.second] for edge in solved.loops)
    assert len(loops)
    assert loops[0] >= first_loop
    assert path_error(Trajectory(log.odometry.stamps, before), true) < 0.2 * path_error(log.odometry, true)
    without = dataclasses.replace(SlamSettings(), loops=dataclasses.replace(SlamSettings().loops, enabled=False))
    *_, tracked = online_poses(log, without)
    for poses in online_poses(log, without):
        np.testing.assert_allclose(poses, tracked[: len(poses)], atol=1e-9)


def test_equal_logs_give_equal_bytes(corridor, solved):
    again = slam(corridor[0])
    assert again.trajectory.poses.tobytes() == solved.trajectory.poses.tobytes()
    assert [edge.covariance.tobytes() for edge in again.edges] == [edge.covariance.tobytes() for edge in solved.edges]


def test_the_result_is_complete(corridor, solved):
    log, _ = corridor
    assert np.array_equal(solved.trajectory.stamps, log.odometry.stamps)
    assert solved.trajectory.poses[0] == pytest.approx(np.zeros(3), abs=1e-12)
    assert solved.keyframes[0] == 0
    assert (np.diff(solved.keyframes) > 0).all()
    assert {(edge.first, edge.second) for edge in solved.edges} >= {(k - 1, k) for k in range(1, len(solved.keyframes))}
    assert set(solved.timings) == {"tracking", "loops", "adjustment", "registration"}


def test_a_standing_robot_stays():
    log, _ = log_of(office(), np.tile((1.0, 1.0, 0.5), (30, 1)), noise=0.02, seed=2)
    result = slam(log)
    assert np.abs(result.trajectory.poses).max() < 0.02
    assert len(result.keyframes) == 1


def test_exact_scans_and_odometry_are_left_as_they_are():
    log, true = log_of(office(), along(np.array([(0.0, 0.0), (4.0, 0.5), (4.0, 2.5)])))
    assert path_error(slam(log).trajectory, true) < 0.004


def test_without_odometry_the_scans_alone_suffice():
    log, true = log_of(
        office(), along(np.array([(0.0, 0.0), (4.0, 0.5), (4.0, 2.5)]), speed=0.03, turn=0.05), noise=0.01
    )
    blind = dataclasses.replace(log, odometry=dataclasses.replace(log.odometry, poses=np.zeros_like(true.poses)))
    motion = dataclasses.replace(SlamSettings().motion, odometry=False)
    result = slam(blind, dataclasses.replace(SlamSettings(), motion=motion))
    assert path_error(result.trajectory, true) < 0.03


def test_scans_that_see_nothing_leave_the_odometry():
    log, _ = log_of(
        np.array([(100.0, 100.0, 101.0, 100.0)]), along(np.array([(0.0, 0.0), (3.0, 0.0)])), odometry_noise=1.0
    )
    result = slam(log)
    assert result.trajectory.poses == pytest.approx(log.odometry.from_start().poses, abs=1e-6)
    assert not result.loops


def test_an_odometry_that_jumps_is_caught_by_the_search():
    """A wheel that slips by 40 degrees at once leaves the reach of Gauss-Newton."""
    poses = along(np.array([(0.0, 0.0), (4.0, 0.5), (4.0, 2.5)]))
    log, true = log_of(office(), poses, noise=0.01, seed=5)
    jumped = log.odometry.poses.copy()
    jumped[40:, 2] += 0.7
    c, s = math.cos(0.7), math.sin(0.7)
    jumped[40:, :2] = jumped[39, :2] + (jumped[40:, :2] - jumped[39, :2]) @ np.array([[c, s], [-s, c]])
    log = dataclasses.replace(log, odometry=dataclasses.replace(log.odometry, poses=jumped))
    assert path_error(slam(log).trajectory, true) < 0.03


def test_the_names_of_the_front_ends_are_the_values_of_the_setting():
    assert (*FRONT_ENDS, TRUE_POSES) == POSES


@pytest.mark.parametrize(
    ("step", "field", "value"),
    [
        ("match", "shrink", 1.0), ("match", "iterations", 0), ("local_map", "greatest_voxel", 0.05),
        ("motion", "greatest_level", 0.1), ("keyframes", "links", (5, 10)), ("loops", "shift", (5.0, 0.5)),
        ("points", "most_neighbours", 1), ("adjustment", "nodes", -1), ("loops", "min_agreement", 1.5),
    ],
)  # fmt: skip
def test_settings_out_of_bounds_are_refused_by_name(step, field, value):
    with pytest.raises(ValueError, match=field):
        dataclasses.replace(getattr(SlamSettings(), step), **{field: value})
