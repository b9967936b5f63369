"""When a robot counts as stuck, and what it does then."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.scan import LidarScan
from sim.navigation.navigator import Navigator
from sim.navigation.routes import Routes
from sim.navigation.settings import StuckSettings
from sim.navigation.stuck import StuckDetector
from sim.physics.robot import RobotSettings
from sim.physics.stopwatch import Stopwatch
from sim.sensors.lidar import Lidar

TENTHS = np.arange(0.0, StuckSettings.time + 0.35, 0.1)


def stuck_at(speed: float, turn_rate: float) -> list[float]:
    watch = StuckDetector()
    return [now for now in TENTHS if watch.update(float(now), np.array((speed * now, 0.0)), turn_rate * now)]


def test_a_robot_that_stands_is_stuck_after_its_time_and_then_anew() -> None:
    (when,) = stuck_at(0.0, 0.0)
    assert StuckSettings.time - 1e-9 <= when <= StuckSettings.time + 0.1


def test_who_drives_or_turns_is_not_stuck() -> None:
    assert stuck_at(0.1, 0.0) == []
    assert stuck_at(0.0, 0.3) == []


def test_creeping_is_being_stuck() -> None:
    assert stuck_at(0.03, 0.0) != []


def test_who_had_no_wish_to_move_begins_anew() -> None:
    watch, here = StuckDetector(), np.zeros(2)
    assert not watch.update(0.0, here, 0.0)
    watch.reset()
    assert not watch.update(StuckSettings.time, here, 0.0)


class Stubborn:
    """Always wants to the same place, and notes which places it is told not to choose."""

    finished = False

    def __init__(self) -> None:
        self.told: list[list[tuple[float, float]]] = []

    def observe(self, scan: LidarScan, world_from_base: SE2) -> None:
        """See nothing new."""

    def known_map(self) -> OccupancyGrid:
        """A hall all free."""
        return OccupancyGrid(GridFrame(0.1, SE2(-5.0, -5.0, 0.0), (100, 100)), np.full((100, 100), -3.0))

    def choose_path(
        self, now: float, grid: OccupancyGrid, routes: Routes, banned: list[NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """The straight way there, whatever is banned."""
        self.told.append([(float(x), float(y)) for x, y in banned])
        return np.stack((np.linspace(0.0, 3.0, 31), np.zeros(31)), axis=-1)


def test_a_goal_that_a_robot_cannot_get_to_is_banned_for_a_while() -> None:
    policy, lidar = Stubborn(), Lidar()
    navigator = Navigator(RobotSettings(lidar), 0, policy, Stopwatch())
    nothing = np.full(lidar.beams, np.inf)
    for now in np.arange(0.0, 22.0, 0.1):
        navigator.command(lidar.scan(float(now), nothing), SE2())  # it is told to drive, and stays where it is
    assert policy.told[0] == []
    assert (3.0, 0.0) in policy.told[-1]
    assert len(policy.told[-1]) <= StuckSettings.ban_time / StuckSettings.time + 1
