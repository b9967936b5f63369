"""The curves of a sweep are plausible."""

from __future__ import annotations

import pytest

from mapquilt.study.results import asked_pairs
from tests.mapquilt.study.conftest import plan, run

NOISES, POSES = ("0", "1", "3"), ("odometry", "truth")


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Two robots for twenty seconds in four worlds, at three levels of noise and with either poses."""
    wanted = plan(
        f"noise={','.join(NOISES)}",
        f"poses={','.join(POSES)}",
        fixed=("robots=2", "duration=20", "starts=close"),
        methods=("quilt",),
        worlds=("house", "maze", "thesis_hall", "office"),
        missions=1,
        seed=11,
    )
    return run(wanted, tmp_path_factory.mktemp("curves") / "study")


def mean_error(results, noise: str, poses: str) -> float:
    """Mean displacement of the common cells [m] over the pairs of a level, accepted or not."""
    asked = [one for one in asked_pairs(results.plan, results.pairs) if one.pair.level == (noise, poses)]
    assert len(asked) == 4
    return sum(one.error.displacement_m for one in asked) / len(asked)


@pytest.mark.slow
def test_exact_maps_are_merged_wherever_they_overlap(results):
    asked = [one for one in asked_pairs(results.plan, results.pairs) if one.truth.overlap > 0.3]
    exact = [one for one in asked if one.pair.level == ("0", "truth")]
    assert len(exact) >= 3
    assert {one.outcome for one in exact} == {"true accept"}


@pytest.mark.slow
def test_errors_grow_with_noise(results):
    errors = [mean_error(results, noise, "odometry") for noise in NOISES]
    assert errors == sorted(errors)
    assert errors[-1] > 5.0 * errors[0]


@pytest.mark.slow
def test_without_noise_odometry_is_the_truth(results):
    assert mean_error(results, "0", "odometry") == pytest.approx(mean_error(results, "0", "truth"), abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("noise", NOISES[1:])
def test_true_poses_halve_the_error_of_odometry_and_lose_no_pair(results, noise):
    assert mean_error(results, noise, "truth") < mean_error(results, noise, "odometry") / 2.0
    accepted = [results.cell((noise, poses), "quilt").pairs.true_accepts.count for poses in POSES]
    assert accepted == sorted(accepted)


@pytest.mark.slow
def test_maps_get_worse_with_noise(results):
    quality = [results.cell((noise, "odometry"), "quilt").f1_walls.value for noise in NOISES]
    assert quality == sorted(quality, reverse=True)
    assert results.cell(("3", "truth"), "quilt").f1_walls.value > quality[-1]
