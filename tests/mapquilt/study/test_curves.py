"""The curves of a sweep are plausible."""

from __future__ import annotations

from itertools import pairwise

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


def share(results, noise: str, poses: str):
    return results.cell((noise, poses), "quilt").pairs.true_accepts


@pytest.mark.slow
def test_exact_maps_are_merged_wherever_they_overlap(results):
    asked = [one for one in asked_pairs(results.plan, results.pairs) if one.truth.overlap > 0.3]
    exact = [one for one in asked if one.pair.level == ("0", "truth")]
    assert len(exact) >= 3
    assert {one.outcome for one in exact} == {"true accept"}


@pytest.mark.slow
@pytest.mark.parametrize("poses", POSES)
def test_success_does_not_rise_with_noise_beyond_its_interval(results, poses):
    for less, more in pairwise(NOISES):
        assert share(results, more, poses).value <= share(results, less, poses).interval.high


@pytest.mark.slow
@pytest.mark.parametrize("noise", NOISES)
def test_true_poses_do_no_worse_than_odometry(results, noise):
    assert share(results, noise, "truth").value >= share(results, noise, "odometry").interval.low


@pytest.mark.slow
def test_maps_get_worse_with_noise(results):
    quality = [results.cell((noise, "odometry"), "quilt").f1_walls.value for noise in NOISES]
    assert quality == sorted(quality, reverse=True)
    assert results.cell(("3", "truth"), "quilt").f1_walls.value > quality[-1]
