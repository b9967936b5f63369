"""Short missions for many tests."""

from __future__ import annotations

import pytest

from mapping.geometry.se2 import SE2
from sim.mission.mission import Mission
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.physics.robot import RobotSettings
from sim.sensors.lidar import Lidar
from worlds.families.registry import make_world
from worlds.polygon import box
from worlds.world import World


@pytest.fixture(scope="session")
def short_settings() -> MissionSettings:
    return MissionSettings((RobotSettings(Lidar(base_from_lidar=SE2(0.08, -0.02, 0.4))),) * 3, duration=12.0)


@pytest.fixture(scope="session")
def mission(short_settings: MissionSettings) -> Mission:
    return simulate(make_world("office", 1), short_settings, seed=5)[0]


@pytest.fixture(scope="session")
def two_rooms() -> World:
    """A hall of 8 x 5 m with a wall across that leaves a door of 1 m, and a crate."""
    walls = (box(0, 0, 8, 0.2), box(0, 4.8, 8, 5), box(0, 0, 0.2, 5), box(7.8, 0, 8, 5))
    return World("two rooms", 0, (8.0, 5.0), (*walls, box(4, 0, 4.2, 2), box(4, 3, 4.2, 5), box(6, 1, 6.6, 1.6)))
