"""The truth of distorted maps: known answers, and beams that the fit must leave out."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.ground_truth.ambiguity_search import Identifiability
from mapping.ground_truth.beam_endpoints import BeamEndpoints, beam_endpoints
from mapping.ground_truth.footprint import observed
from mapping.ground_truth.truth import (
    MIN_COMMON_CELLS,
    PairOverlap,
    fit_rigid,
    map_truth,
    overlap,
    pair_truth,
)
from mapping.robot.robot_log import RobotLog, RobotTruth
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory

metres = st.floats(-20, 20)
poses = st.builds(SE2, metres, metres, st.floats(-math.pi, math.pi))
similarities = st.builds(Similarity2, metres, metres, st.floats(-math.pi, math.pi), st.floats(0.5, 2.0))
BEAMS = 90
MOUNTING = SE2(0.2, -0.1, 2.0)


def box_scan(world_from_lidar, stamp, low=0.0, high=10.0):
    """Scan an empty box [low, high]^2: the nearest wall along each beam."""
    angles = -math.pi + 2 * math.pi / BEAMS * np.arange(BEAMS)
    ways = np.stack((np.cos(angles + world_from_lidar.yaw), np.sin(angles + world_from_lidar.yaw)), axis=-1)
    start = np.array([world_from_lidar.x, world_from_lidar.y])
    with np.errstate(divide="ignore"):
        reach = np.where(ways > 0, (high - start) / ways, (low - start) / ways).min(axis=1)
    return LidarScan(stamp, -math.pi, 2 * math.pi / BEAMS, 0.01, 30.0, reach.astype(np.float32))


def robot(path):
    """Drive a robot through the box: its truth, and a log with exact odometry."""
    trajectory = Trajectory(np.arange(float(len(path))), np.array(path))
    scans = tuple(box_scan(trajectory.pose(k) @ MOUNTING, float(k)) for k in range(len(path)))
    truth = RobotTruth(scans, trajectory, np.zeros((len(path), BEAMS), bool), MOUNTING)
    return truth, RobotLog(scans, trajectory.from_start(), MOUNTING)


PATH_A = [(2.0, 2.0, 0.4), (3.0, 2.5, 0.9), (4.0, 4.0, 1.5)]
PATH_B = [(8.0, 7.0, -2.0), (7.0, 6.0, -2.5), (5.0, 5.0, 3.0)]
NOTHING = np.zeros((3, BEAMS), bool)
FOOTPRINTS = PairOverlap(0.5, Identifiability(1.0, 0.2))


def seen_by(path, odometry=None):
    truth, log = robot(path)
    return beam_endpoints(log, truth, odometry or log.odometry, NOTHING), truth


@given(poses)
def test_fit_recovers_a_motion(motion):
    points = np.random.default_rng(0).uniform(-5, 5, (30, 2))
    fit = fit_rigid(points, motion.apply(points))
    assert np.allclose(fit.apply(points), motion.apply(points), atol=1e-9)


def test_fit_of_opposite_points_is_not_a_reflection():
    source = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 0.2]])
    fit = fit_rigid(source, source * (1.0, -1.0))
    assert fit.yaw == pytest.approx(0.0, abs=1e-12)


@given(similarities)
def test_without_drift_the_truth_of_a_map_is_the_robots_start(start_from_map):
    seen, truth = seen_by(PATH_A)
    world_from_start = truth.trajectory.pose(0)
    fitted = map_truth(seen, world_from_start, start_from_map)
    expected = Similarity2.from_se2(world_from_start) @ start_from_map
    points = np.array([[0.0, 0.0], [5.0, 1.0]])
    assert np.allclose(fitted.world_from_map.apply(points), expected.apply(points), atol=1e-4)
    assert np.allclose(fitted.world_from_start_map.apply(points), expected.apply(points))
    assert fitted.distortion < 1e-5


@given(similarities, similarities)
def test_without_drift_the_pair_is_the_two_maps_composed(target_start_from_map, source_start_from_map):
    (target, target_truth), (source, source_truth) = seen_by(PATH_A), seen_by(PATH_B)
    pair = pair_truth(target, source, target_start_from_map, source_start_from_map, FOOTPRINTS)
    world_from_target = Similarity2.from_se2(target_truth.trajectory.pose(0)) @ target_start_from_map
    world_from_source = Similarity2.from_se2(source_truth.trajectory.pose(0)) @ source_start_from_map
    expected = world_from_target.inverse() @ world_from_source
    points = np.array([[0.0, 0.0], [5.0, 1.0], [-3.0, 2.0]])
    # Beams of the two robots hit anywhere within the same true cells: the fit is that good, no better.
    assert np.allclose(pair.target_from_source.apply(points), expected.apply(points), atol=0.1)
    assert pair.target_from_source.scale == pytest.approx(source_start_from_map.scale / target_start_from_map.scale)
    assert pair.fitted
    assert pair.residual < 0.05


def test_a_distorted_map_has_a_truth_between_start_and_end():
    truth, log = robot(PATH_A)
    distorted = log.odometry.poses + np.array([[0, 0, 0], [0.2, 0, 0], [0.6, 0, 0]])
    seen = beam_endpoints(log, truth, Trajectory(log.odometry.stamps, distorted), NOTHING)
    fitted = map_truth(seen, truth.trajectory.pose(0), Similarity2())
    shift = fitted.world_from_map.inverse() @ fitted.world_from_start_map
    assert 0.05 < fitted.distortion < 0.5
    assert 0.1 < math.hypot(shift.x, shift.y) < 0.6


def test_replaced_readings_and_hits_on_robots_are_left_out():
    truth, log = robot(PATH_A)
    replaced, hits_robot = np.zeros((2, 3, BEAMS), bool)
    replaced[:, 10], hits_robot[:, 20] = True, True
    wrong = []
    for scan in log.scans:
        ranges = scan.ranges.copy()
        ranges[[10, 20]] = 0.5
        wrong.append(LidarScan(scan.stamp, scan.angle_min, scan.angle_increment, 0.01, 30.0, ranges))
    spoilt = RobotLog(tuple(wrong), log.odometry, MOUNTING)
    marked = RobotTruth(truth.scans, truth.trajectory, hits_robot, MOUNTING)
    clean = map_truth(beam_endpoints(spoilt, marked, log.odometry, replaced), truth.trajectory.pose(0), Similarity2())
    dirty = map_truth(beam_endpoints(spoilt, truth, log.odometry, NOTHING), truth.trajectory.pose(0), Similarity2())
    assert clean.distortion < 1e-5 < 0.01 < dirty.distortion


def test_with_too_few_common_cells_the_pair_is_composed():
    (target, _), (source, _) = seen_by(PATH_A), seen_by(PATH_B)
    few = MIN_COMMON_CELLS - 1
    apart = BeamEndpoints(
        np.concatenate((source.cells[:few], source.cells[few:] + 10_000)), source.true, source.estimated
    )
    perturbations = Similarity2(3.0, -1.0, 0.7, 1.4), Similarity2(-2.0, 5.0, -1.1, 0.8)
    pair = pair_truth(target, apart, *perturbations, FOOTPRINTS)
    world_from_target, world_from_source = (
        Similarity2.from_se2(SE2(*path[0])) @ start_from_map
        for path, start_from_map in zip((PATH_A, PATH_B), perturbations, strict=True)
    )
    points = np.array([[0.0, 0.0], [5.0, 1.0], [-3.0, 2.0]])
    expected = world_from_target.inverse() @ world_from_source
    assert np.allclose(pair.target_from_source.apply(points), expected.apply(points), atol=1e-3)
    assert not pair.fitted
    assert pair.residual is None
    assert pair.common_cells <= few


def test_each_true_cell_has_the_same_weight():
    """A wall that was observed a hundred times counts no more than one that was observed once."""
    truth, log = robot(PATH_A)
    distorted = log.odometry.poses + np.array([[0, 0, 0], [0.2, 0, 0], [0.6, 0, 0]])
    once = beam_endpoints(log, truth, Trajectory(log.odometry.stamps, distorted), NOTHING)
    visits = [0] * 100 + [1, 2]
    stamps = np.arange(float(len(visits)))
    scans = tuple(dataclasses.replace(log.scans[k], stamp=float(n)) for n, k in enumerate(visits))
    beams = np.zeros((len(visits), BEAMS), bool)
    slow = RobotTruth(scans, Trajectory(stamps, truth.trajectory.poses[visits]), beams, MOUNTING)
    slow_log = RobotLog(scans, Trajectory(stamps, log.odometry.poses[visits]), MOUNTING)
    often = beam_endpoints(slow_log, slow, Trajectory(stamps, distorted[visits]), beams)
    start = truth.trajectory.pose(0)
    a, b = (map_truth(seen, start, Similarity2()).world_from_map for seen in (once, often))
    # The robot's three views share few cells; by beams the fit would move by about 0.2 m, by cells by millimetres.
    assert math.hypot(a.x - b.x, a.y - b.y) < 0.02


def test_observed_cells_lie_in_the_box_and_include_free_space():
    truth, _ = robot(PATH_A)
    world = GridFrame(0.05, SE2(), (220, 220))
    seen = observed(truth, world)
    rows, cols = np.nonzero(seen)
    assert rows.max() <= 200
    assert cols.max() <= 200
    start = truth.trajectory.pose(0) @ MOUNTING
    assert seen[int(start.y / 0.05), int(start.x / 0.05)]


def test_overlap_is_a_share_of_the_smaller_footprint():
    a, b = np.zeros((10, 10), bool), np.zeros((10, 10), bool)
    a[:, :6], b[:, 4:6] = True, True
    assert overlap(a, b) == 1.0
    b[:, 6:8] = True
    assert overlap(a, b) == pytest.approx(0.5)
    assert overlap(a, np.zeros_like(a)) == 0.0
