"""From a mission to maps: poses, seeds and robots."""

import dataclasses

import numpy as np
import pytest

from mapping.settings import MappingSettings
from mapquilt.runs.sample import make_sample
from mapquilt.runs.true_footprints import true_footprints
from mapquilt.settings import SampleSettings
from sim.mission.file import load_mission
from sim.sensors.settings import SensingSettings


@pytest.fixture(scope="module")
def mission(merged_run):
    """A robot and its double, which drove the same way and saw the same."""
    mission = load_mission(merged_run / "mission")
    settings = dataclasses.replace(mission.settings, robots=mission.settings.robots[:1] * 2)
    return dataclasses.replace(mission, robots=mission.robots[:1] * 2, settings=settings)


@pytest.fixture(scope="module")
def places(mission):
    return true_footprints(mission)


def test_true_poses_are_relative_to_the_start_like_odometry(mission, places):
    by_truth, by_odometry = (
        make_sample(mission, SampleSettings(SensingSettings(0.0), MappingSettings(poses)), places)
        for poses in ("truth", "odometry")
    )
    for one, other in zip(by_truth.maps.grids, by_odometry.maps.grids, strict=True):
        assert one.frame == other.frame
        assert np.array_equal(one.log_odds, other.log_odds)


def test_noise_is_that_of_the_samples_seed_and_not_of_the_missions(mission, places):
    settings = SampleSettings(seed=mission.seed + 1)
    sample = make_sample(mission, settings, places)
    again = make_sample(dataclasses.replace(mission, seed=mission.seed + 9), settings, places)
    other = make_sample(mission, SampleSettings(seed=mission.seed), places)
    ranges = [each.logs[0].scans[3].ranges for each in (sample, again, other)]
    assert np.array_equal(ranges[0], ranges[1])
    assert not np.array_equal(ranges[0], ranges[2])
    assert not np.array_equal(sample.logs[0].odometry.poses, other.logs[0].odometry.poses)


def test_each_robot_has_its_own_noise_and_frame_perturbation(mission, places):
    sample = make_sample(mission, SampleSettings(), places)
    one, double = sample.logs
    assert not np.array_equal(one.scans[3].ranges, double.scans[3].ranges)
    assert not np.array_equal(one.odometry.poses, double.odometry.poses)
    assert sample.truth.robots[0].start_from_map != sample.truth.robots[1].start_from_map
    assert [log.robot for log in sample.logs] == list(sample.maps.names)
