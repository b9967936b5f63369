"""Errors of trajectories: hand-made answers, a brute-force fit, and laws."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from mapping.geometry.se2 import SE2
from mapping.io.relations_file import Relations, load_relations
from mapping.robot.trajectory import Trajectory
from mapquilt.evaluation.trajectory_error import absolute_error, matched, relations_error, relative_error

seeds = st.integers(0, 2**32 - 1)
motions = st.builds(SE2, st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-3.0, 3.0))


def walk(seed: int, count: int = 30) -> Trajectory:
    rng = np.random.default_rng(seed)
    steps = np.column_stack((rng.uniform(0.1, 1.0, count), rng.normal(0.0, 0.1, count), rng.normal(0.0, 0.4, count)))
    poses = [SE2()]
    for step in steps[1:].tolist():
        poses.append(poses[-1] @ SE2(*step))
    return Trajectory(np.cumsum(rng.uniform(0.1, 0.5, count)), [(pose.x, pose.y, pose.yaw) for pose in poses])


@given(seeds, motions)
def test_errors_do_not_depend_on_the_frame(seed: int, motion: SE2) -> None:
    reference = walk(seed)
    estimate = Trajectory(reference.stamps, reference.poses + np.random.default_rng(seed).normal(0.0, 0.1, (30, 3)))
    for one, other in [(estimate, reference), (estimate.moved(motion), reference), (estimate, reference.moved(motion))]:
        absolute, relative = absolute_error(one, other), relative_error(one, other, 2.0, "m")
        assert relative.error is not None
        found = [*absolute.position, *absolute.yaw, relative.error.translation.rmse, relative.error.rotation.max]
        if one is estimate and other is reference:
            expected = found
        np.testing.assert_allclose(found, expected, atol=1e-9)


@given(seeds, motions)
def test_a_moved_trajectory_has_no_error(seed: int, motion: SE2) -> None:
    reference = walk(seed)
    found = absolute_error(reference.moved(motion), reference)
    assert max(found.position.max(), found.yaw.max()) < 1e-9
    np.testing.assert_allclose((found.reference_from_estimate @ motion).log(), 0.0, atol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_no_other_rigid_motion_fits_better(seed: int) -> None:
    reference = walk(seed)
    estimate = Trajectory(reference.stamps, reference.poses + np.random.default_rng(seed).normal(0.0, 0.5, (30, 3)))

    def rms(tangent: np.ndarray) -> float:
        moved = estimate.moved(SE2(*tangent)).poses - reference.poses
        return float(np.sqrt((moved[:, :2] ** 2).sum(axis=1).mean()))

    best = min(minimize(rms, (0.0, 0.0, yaw), method="Nelder-Mead", tol=1e-10).fun for yaw in np.arange(-3.0, 3.0))
    found = absolute_error(estimate, reference).position
    assert float(np.sqrt((found**2).mean())) == pytest.approx(best, abs=1e-7)


def test_a_bump_off_a_straight_line() -> None:
    """Four poses along x; two of them 0.4 m off to either side: the best fit is the identity."""
    reference = Trajectory(range(4), [(x, 0.0, 0.0) for x in (-3.0, -1.0, 1.0, 3.0)])
    estimate = Trajectory(range(4), [(-3.0, 0.0, 0.0), (-1.0, 0.4, 0.0), (1.0, 0.4, 0.0), (3.0, 0.0, 0.0)])
    found = absolute_error(estimate, reference)
    np.testing.assert_allclose(found.position, 0.2, atol=1e-12)


def test_relative_errors_of_an_odometry_that_is_ten_per_cent_long() -> None:
    reference = Trajectory(range(11), [(float(x), 0.0, 0.0) for x in range(11)])
    estimate = Trajectory(range(11), [(1.1 * x, 0.0, 0.01 * x) for x in range(11)])
    metres = relative_error(estimate, reference, 5.0, "m").error
    seconds = relative_error(estimate, reference, 1.0, "s").error
    assert metres is not None
    assert seconds is not None
    assert (metres.pairs, seconds.pairs) == (6, 10)
    assert metres.rotation.median == pytest.approx(0.05)
    # from pose 0 (yaw 0): exactly 0.5 m too long; from pose 5: the same displacement in a turned frame
    turned = math.hypot(5.5 * math.cos(0.05) - 5.0, 5.5 * math.sin(0.05))
    assert metres.translation.max == pytest.approx(turned)
    assert seconds.rotation.rmse == pytest.approx(0.01)


def test_a_window_longer_than_the_path_has_no_error() -> None:
    short = Trajectory([0.0, 1.0], [(0.0, 0.0, 0.0), (0.5, 0.0, 0.0)])
    assert relative_error(short, short, 1.0, "m").error is None


def test_stamps_are_matched_to_the_nearest_and_once() -> None:
    reference = Trajectory([0.0, 1.0, 2.0, 3.0], np.arange(12.0).reshape(4, 3))
    estimate = Trajectory([0.011, 0.995, 1.004, 2.05, 2.99], np.arange(15.0).reshape(5, 3))
    mine, theirs = matched(estimate, reference)
    np.testing.assert_array_equal(mine.stamps, [0.011, 1.004, 2.99])
    np.testing.assert_array_equal(theirs.stamps, [0.0, 1.0, 3.0])


def test_trajectories_of_other_times_are_refused() -> None:
    one = Trajectory([0.0, 1.0], np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"0 poses within 0\.02 s of the reference.*from 100\.0 to 101\.0 s"):
        matched(Trajectory([100.0, 101.0], np.zeros((2, 3))), one)


def test_relations_that_the_estimate_misses_by_known_amounts(tmp_path: Path) -> None:
    """A quarter turn in between: an error is expressed in the frame of the second pose."""
    path = tmp_path / "hand.relations"
    lines = ["# header", "1.0 2.0 1.0 0.0 0 0 0 1.5707963", "1.0004 3.0 0.0 2.0 9 9 9 0.1", "1.0 9.0 0 0 0 0 0 0"]
    path.write_text("\n".join(lines))
    poses = [(5.0, 5.0, math.pi / 2), (4.7, 6.4, math.pi), (3.0, 5.0, math.pi / 2)]
    found = relations_error(Trajectory([1.0, 2.0, 3.0], poses), load_relations(path))
    assert found.pairs == 2
    # first relation: true (1, 0), estimated (1.4, 0.3): 0.5 m; second: (0, 2) both, 0.1 rad
    assert found.translation.mean == pytest.approx(0.25, abs=1e-6)
    assert found.translation.std == pytest.approx(0.25, abs=1e-6)
    assert found.translation.max == pytest.approx(0.5)
    assert found.rotation.max == pytest.approx(0.1)


@given(seeds, motions)
def test_relations_of_the_reference_itself_have_no_error(seed: int, motion: SE2) -> None:
    reference = walk(seed)
    first, second = np.random.default_rng(seed).integers(0, 30, (2, 20))
    pairs = [(reference.pose(a).inverse() @ reference.pose(b)) for a, b in zip(first, second, strict=True)]
    stamps = np.column_stack((reference.stamps[first], reference.stamps[second]))
    relations = Relations(stamps, np.array([(pair.x, pair.y, pair.yaw) for pair in pairs]))
    found = relations_error(reference.moved(motion), relations)
    assert found.pairs == 20
    assert max(found.translation.max, found.rotation.max) < 1e-9


def test_relations_of_another_log_are_refused() -> None:
    with pytest.raises(ValueError, match="none of 1 relations has both stamps"):
        relations_error(walk(1), Relations([[100.0, 101.0]], [[0.0, 0.0, 0.0]]))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file is empty"),
        ("1 2 3 4 5 6 7", "line 1 has 7 numbers, must be stamp1 stamp2"),
        ("\n1 2 3 4 5 6 7 nan", "line 2: 'nan' is no number"),
    ],
)
def test_a_damaged_relations_file_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "bad.relations"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        load_relations(path)
