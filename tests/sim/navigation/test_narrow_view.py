"""Robots with a narrow field of view explore too."""

from __future__ import annotations

import numpy as np
import pytest

from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.physics.robot import RobotSettings
from sim.sensors.lidar_presets import lidar_preset, with_rate
from worlds.families.registry import make_world


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hokuyo_urg04lx", "sick_lms200"])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_team_with_forward_lidars_yields_and_hits_nothing(name: str, seed: int) -> None:
    lidar = with_rate(lidar_preset(name).lidar, 10.0)
    settings = MissionSettings((RobotSettings(lidar),) * 2, duration=30.0)
    mission, _ = simulate(make_world("office", seed), settings, seed)
    assert mission.contacts == (0, 0)
    for robot in mission.robots:
        assert robot.trajectory.distance() > 6.0
        places = robot.trajectory.poses[:, :2]
        assert np.hypot(*(places - places[0]).T).max() > 3.0
