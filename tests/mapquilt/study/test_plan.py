"""Every setting can be varied by name; invalid studies are refused with the option and the value."""

from __future__ import annotations

import pytest

from mapquilt.study.plan import Method, plan_study
from mapquilt.study.variables import SWEEPS
from tests.mapquilt.study.conftest import plan


@pytest.mark.parametrize("name", SWEEPS)
def test_each_sweep_that_has_a_name_can_be_planned(name):
    found = plan_study(name, (), (), [Method("quilt")], ("office",), 1, 1, 0.15)
    assert len(found.levels) >= 4
    assert len(set(found.setups)) == len(found.levels)


def test_two_settings_make_every_combination_and_share_all_seeds():
    found = plan("noise=0,1,2", "poses=odometry,truth")
    assert found.levels == tuple((noise, poses) for noise in "012" for poses in ("odometry", "truth"))
    tasks = found.tasks(None)
    assert len({task.seed for task in tasks}) == len(tasks)
    assert plan("noise=0,5").tasks(None)[1].sample_seed == tasks[1].sample_seed


@pytest.mark.parametrize(
    ("vary", "fixed", "words"),
    [
        ((), (), "one setting or two, not 0"),
        (("noise=0,1", "poses=odometry,truth", "robots=2,3"), (), "one setting or two, not 3"),
        (("nose=0,1",), (), "--vary nose=0,1: nose is no setting; did you mean noise"),
        (("noise",), (), "--vary noise: must be NAME=VALUE"),
        (("noise=1",), (), "one value is no variation"),
        (("noise=1,1",), (), "1: is named twice"),
        (("noise=0,1", "noise=0,2"), (), "--vary sensing.noise: is named twice"),
        (("noise=0,40",), (), "--vary sensing.noise=40: noise is 40.0, must lie between 0 and 20"),
        (("noise=0,much",), (), "--vary sensing.noise=much: 'much' is no number"),
        (("lidar.dropout=0,2",), (), "--vary sensing.lidar.dropout=2: .*probability of at most 1"),
        (("beams=100,360",), (), "--vary mission.beams=100: beams is 100, must divide the 360"),
        (("robots=1,2",), (), "--vary robots is 1, must be at least 2"),
        (("poses=odometry,guess",), (), "--vary mapping.poses=guess: poses is 'guess'"),
        (("noise=0,1",), ("noise=2",), "--set noise=2: the study varies sensing.noise"),
        (("noise=0,1",), ("resolution=0",), "--set mapping.resolution=0: resolution is 0.0, must lie"),
        (("family=house,atlantis",), (), "unknown world 'atlantis'"),
    ],
)
def test_invalid_studies_are_refused(vary, fixed, words):
    with pytest.raises(ValueError, match=words):
        plan(*vary, fixed=fixed)


def test_methods_worlds_and_numbers_are_checked_before_anything_runs():
    with pytest.raises(ValueError, match="method is 'magic'"):
        plan("noise=0,1", methods=("magic",))
    with pytest.raises(ValueError, match="--method quilt: is named twice"):
        plan("noise=0,1", methods=("quilt", "quilt"))
    with pytest.raises(ValueError, match="unknown world 'atlantis'"):
        plan("noise=0,1", worlds=("atlantis",))
    with pytest.raises(ValueError, match="--missions 0"):
        plan("noise=0,1", missions=0)
    with pytest.raises(ValueError, match="--min-overlap 2"):
        plan("noise=0,1", min_overlap=2.0)
