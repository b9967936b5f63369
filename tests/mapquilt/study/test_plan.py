"""Every setting can be varied by name, and what makes no study is refused with the option and the value."""

from __future__ import annotations

import math

import pytest

from mapquilt.study.plan import Method, plan_study
from mapquilt.study.setup import ExperimentConfig
from mapquilt.study.variables import SWEEPS, VARIABLES, variable
from sim.sensors.noise import COMPONENTS
from sim.sensors.odometry import OdometryNoise
from tests.mapquilt.study.conftest import plan

VALUES = {
    "poses": "truth",
    "scale": "0.8:1.25",
    "model": "hector",
    "world": "house",
    "lidar": "rplidar_a1",
    "starts": "close",
    "drive": "wheels",
    "policy": "tour",
    "overlap": "0.2:0.4",
    "search": "free",
    "beams": "90",
    "rate": "5",
    "robots": "4",
    "parts": "2",
    "min_confidence": "0.5",
    "lidar.level": "2",
    "odometry.level": "2",
    "resolution": "0.1",
    "noise": "2",
}


@pytest.mark.parametrize("name", VARIABLES)
def test_each_setting_changes_the_setup_and_nothing_else(name):
    text = VALUES.get(name, "0.125" if name in COMPONENTS else "20")
    changed = variable(name).applied(ExperimentConfig(), text)
    different = {key for key, value in vars(changed).items() if value != vars(ExperimentConfig())[key]}
    assert different == {"components" if "." in name else name}


def test_the_level_of_the_odometry_scales_all_its_components_and_no_other():
    noise = variable("odometry.level").applied(ExperimentConfig(), "3").sample(1).sensing.noise_of("default")
    assert noise.odometry == OdometryNoise().scaled(3.0)
    assert noise.lidar == ExperimentConfig().sample(1).sensing.noise_of("default").lidar


def test_a_component_is_set_whatever_the_level():
    setup = variable("lidar.range_sigma").applied(variable("noise").applied(ExperimentConfig(), "3"), "0.05")
    assert setup.sample(1).sensing.noise_of("default").lidar.range_sigma == 0.05
    assert setup.sample(1).sensing.noise_of("default").odometry.alpha1 == pytest.approx(3 * OdometryNoise().alpha1)


def test_rotations_are_told_in_degrees():
    assert variable("max_rotation").applied(ExperimentConfig(), "90").sample(1).perturbation.max_yaw == pytest.approx(
        math.pi / 2
    )


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
        (("nose=0,1",), (), "--vary nose=0,1: nose is no setting"),
        (("noise",), (), "--vary noise: must be NAME=VALUE"),
        (("noise=1",), (), "one value is no variation"),
        (("noise=1,1",), (), "1: is named twice"),
        (("noise=0,1", "noise=0,2"), (), "--vary noise: is named twice"),
        (("noise=0,40",), (), "--vary noise=40: noise is 40.0, must lie between 0 and 20"),
        (("noise=0,much",), (), "--vary noise=much: 'much' is no number"),
        (("lidar.dropout=0,2",), (), "--vary lidar.dropout=2: .*a probability is at most 1"),
        (("beams=100,360",), (), "--vary beams=100: beams is 100, must divide the 360"),
        (("robots=1,2",), (), "--vary robots=1: .*at least 2"),
        (("poses=odometry,guess",), (), "--vary poses=guess: poses is 'guess'"),
        (("noise=0,1",), ("noise=2",), "--set noise=2: the study varies noise"),
        (("noise=0,1",), ("resolution=0",), "--set resolution=0: resolution is 0.0, must lie"),
        (("world=house,atlantis",), (), "unknown world 'atlantis'"),
    ],
)
def test_what_makes_no_study_is_refused(vary, fixed, words):
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
