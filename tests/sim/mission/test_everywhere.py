"""Robots explore every family of worlds, on both drives, without collisions."""

from __future__ import annotations

import pytest

from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.physics.drive import Drive
from worlds.families.registry import FAMILIES, make_world


@pytest.mark.parametrize("drive", ["velocity", "wheels"])
@pytest.mark.parametrize("name", FAMILIES)
def test_robots_move_and_touch_nothing(name: str, drive: Drive) -> None:
    seed = 100 + list(FAMILIES).index(name)
    world = make_world(name, seed)
    mission, _ = simulate(world, MissionSettings(2, 5.0, drive=drive), seed)
    assert mission.contacts == (0, 0)
    for robot in mission.robots:
        assert robot.trajectory.distance() > 0.8
        assert world.clearance(robot.trajectory.poses[:, :2]).min() > 0.2
