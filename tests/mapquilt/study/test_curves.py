"""The curves of a sweep make sense."""

from __future__ import annotations

from itertools import pairwise

import pytest

from mapquilt.study.counting import asked
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
    return results.cell((noise, poses), "quilt").right_and_accepted


@pytest.mark.slow
def test_exact_maps_are_merged_wherever_they_overlap(results):
    exact = [t for t in asked(results.plan, results.pairs) if t.level == ("0", "truth") and t.overlap > 0.3]
    assert len(exact) >= 3
    assert [t for t in exact if not (t.right and t.accepted)] == []


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
