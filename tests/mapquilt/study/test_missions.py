"""Missions cut in time, team and beams equal shorter, smaller and sparser ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mapquilt.settings import ExperimentConfig, TeamSettings
from mapquilt.study.missions import cut_mission, largest_mission
from sim.mission.simulation import simulate
from worlds.families.registry import make_world

LONG = ExperimentConfig(mission=TeamSettings(robots=3, duration=3.0))


def changed(**changes: object) -> ExperimentConfig:
    return replace(LONG, mission=replace(LONG.mission, **changes))


@pytest.fixture(scope="module")
def mission():
    return largest_mission("house", 4, [LONG, changed(robots=2, duration=1.0)], None)


def test_a_mission_cut_in_time_equals_a_shorter_simulation(mission):
    cut = cut_mission(mission, changed(duration=1.5))
    short = simulate(make_world("house", 4), changed(duration=1.5).mission.mission(), 4)[0]
    assert len(cut.robots) == len(short.robots)
    for one, other in zip(cut.robots, short.robots, strict=True):
        np.testing.assert_array_equal(one.trajectory.poses, other.trajectory.poses)
        np.testing.assert_array_equal([scan.ranges for scan in one.scans], [scan.ranges for scan in other.scans])


def test_a_smaller_team_is_the_first_robots(mission):
    cut = cut_mission(mission, changed(robots=2))
    assert len(cut.robots) == len(cut.settings.robots) == len(cut.contacts) == 2
    np.testing.assert_array_equal(cut.robots[1].trajectory.poses, mission.robots[1].trajectory.poses)


def test_fewer_beams_keep_their_directions(mission):
    cut = cut_mission(mission, changed(beams=90))
    for few, all_of_them in zip(cut.robots[0].scans, mission.robots[0].scans, strict=True):
        np.testing.assert_allclose(few.angles, all_of_them.angles[::4], atol=1e-12)
        np.testing.assert_array_equal(few.ranges, all_of_them.ranges[::4])
    assert cut.settings.robots[0].lidar.beams == 90


def test_an_overlap_is_reached_by_cutting(mission):
    cut = cut_mission(mission, changed(robots=2, overlap=(0.0, 0.2)))
    assert all(len(one.scans) <= len(whole.scans) for one, whole in zip(cut.robots, mission.robots, strict=False))
