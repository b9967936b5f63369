"""The particle filter: known paths, the same bytes for the same seed, and refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mapping.grid.log_odds import map_log
from mapping.grid.sensor_model import COUNTING
from mapping.particle.filter import ParticleResult, particle_filter
from mapping.particle.settings import GaussianSettings, MatchSettings, MotionNoise, ParticleSettings, Proposal
from mapping.robot.robot_log import RobotLog
from mapping.robot.trajectory import Trajectory
from tests.mapping.particle.room import drifting, room_log, true_path

FEW = ParticleSettings(particles=5)
NO_NOISE = MotionNoise(0.0, 0.0, 0.0, 0.0)


def worst_position(result: ParticleResult, true: Trajectory) -> float:
    return float(np.hypot(*(result.trajectory.poses - true.poses)[:, :2].T).max())


def test_one_particle_without_noise_reproduces_exact_odometry() -> None:
    true = true_path()
    result = particle_filter(room_log(true), ParticleSettings(particles=1, motion=NO_NOISE))
    assert worst_position(result, true) < 0.05  # a cell
    assert result.effective_sizes.tolist() == [1.0] * len(result.updates)


def test_one_particle_without_noise_follows_the_odometry_where_it_sees_nothing() -> None:
    true = true_path()
    log = room_log(true)
    blind = [replace(scan, ranges=np.full_like(scan.ranges, np.inf)) for scan in log.scans[1:]]
    result = particle_filter(replace(log, scans=(log.scans[0], *blind)), ParticleSettings(particles=1, motion=NO_NOISE))
    assert result.trajectory.poses[:, :2] == pytest.approx(true.poses[:, :2], abs=1e-9)


@pytest.mark.parametrize("proposal", ["maximum", "gaussian"])
def test_the_filter_corrects_odometry_that_drifts(proposal: Proposal) -> None:
    true = true_path(scans=90, turns=1.5)
    odometry = drifting(true, stretch=0.03, veer=0.003)
    wheels = float(np.hypot(*(odometry.poses - true.poses)[:, :2].T).max())
    result = particle_filter(room_log(true, odometry), replace(FEW, proposal=proposal), seed=1)
    assert wheels > 0.4
    assert worst_position(result, true) < 0.1


def test_the_same_seed_gives_the_same_bytes_and_another_one_does_not() -> None:
    true = true_path(scans=30)
    log = room_log(true, drifting(true, stretch=0.03, veer=0.003))
    one, again, other = (particle_filter(log, FEW, seed) for seed in (4, 4, 5))
    assert one.trajectory.poses.tobytes() == again.trajectory.poses.tobytes()
    assert one.grid.log_odds.tobytes() == again.grid.log_odds.tobytes()
    assert one.paths.tobytes() == again.paths.tobytes()
    assert one.trajectory.poses.tobytes() != other.trajectory.poses.tobytes()


def test_the_grid_is_the_counting_map_of_the_processed_scans_at_the_best_path() -> None:
    """The oracle draws them in a dense grid: ancestors, shared tiles and resampling must have lost nothing."""
    true = true_path(scans=60)
    log = room_log(true, drifting(true, stretch=0.03, veer=0.003))
    result = particle_filter(log, replace(FEW, weight_smoothing=1.0), seed=2)
    assert len(result.resampled) > 3
    path = Trajectory(log.odometry.stamps[result.updates], result.paths[result.best])
    processed = RobotLog(tuple(log.scans[k] for k in result.updates), path, log.base_from_lidar)
    expected = map_log(processed, path, 0.05, COUNTING)
    assert result.grid.frame.shape == expected.frame.shape
    assert np.array_equal(result.grid.log_odds, expected.log_odds)
    assert result.trajectory.poses[result.updates, :2] == pytest.approx(path.poses[:, :2])


def test_between_updates_the_path_follows_the_odometry() -> None:
    true = true_path(scans=60)
    log = room_log(true, drifting(true, stretch=0.05, veer=0.0))
    result = particle_filter(log, replace(FEW, update_distance=0.7, update_angle=0.7), seed=3)
    between = np.setdiff1d(np.arange(len(true)), result.updates)
    assert result.updates[0] == 0 and between.size > len(result.updates)
    for k in between.tolist():
        mine = result.trajectory.pose(k - 1).inverse() @ result.trajectory.pose(k)
        wheels = log.odometry.pose(k - 1).inverse() @ log.odometry.pose(k)
        assert [mine.x, mine.y, mine.yaw] == pytest.approx([wheels.x, wheels.y, wheels.yaw], abs=1e-9)


def test_an_update_is_due_after_a_distance_or_a_turn() -> None:
    true = true_path(scans=60)
    step = np.hypot(*np.diff(true.poses[:, :2], axis=0).T)
    far = particle_filter(room_log(true), replace(FEW, update_distance=1.0, update_angle=100.0))
    for start, end in zip(far.updates[:-1], far.updates[1:], strict=True):
        assert step[start : end - 1].sum() < 1.0 <= step[start:end].sum()
    turning = particle_filter(room_log(true), replace(FEW, update_distance=100.0, update_angle=0.5))
    for start, end in zip(turning.updates[:-1], turning.updates[1:], strict=True):
        assert (
            abs(true.poses[end - 1, 2] - true.poses[start, 2]) < 0.5 <= abs(true.poses[end, 2] - true.poses[start, 2])
        )


def test_progress_counts_every_scan() -> None:
    done: list[int] = []
    particle_filter(room_log(true_path(scans=8)), FEW, on_scan=done.append)
    assert done == list(range(1, 9))


def test_a_log_that_saw_nothing_has_no_map() -> None:
    log = room_log(true_path(scans=4))
    blind = tuple(replace(scan, ranges=np.full_like(scan.ranges, np.inf)) for scan in log.scans)
    with pytest.raises(ValueError, match="no beam of any scan measured anything"):
        particle_filter(replace(log, scans=blind), FEW)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ParticleSettings(particles=0), "ParticleSettings: particles is 0, must be positive"),
        (lambda: ParticleSettings(resample_below=1.5), "resample_below is 1.5, must lie between 0 and 1"),
        (lambda: ParticleSettings(proposal="best"), "proposal is 'best', must be one of maximum, gaussian"),  # type: ignore[arg-type]
        (lambda: MotionNoise(rotation_from_rotation=-0.1), "MotionNoise: rotation_from_rotation is -0.1, must not be"),
        (lambda: MatchSettings(least_hits=1.1), "least_hits is 1.1, must lie between 0 and 1"),
        (lambda: MatchSettings(deviation=0.0), "MatchSettings: deviation is 0.0, must be positive"),
        (lambda: GaussianSettings(spacing=float("nan")), "GaussianSettings: spacing is nan, must be finite"),
    ],
)
def test_settings_out_of_range_are_refused(make: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        make()  # type: ignore[operator]
