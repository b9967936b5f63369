"""Detection of stuck robots, and recovery."""

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


def test_a_standing_robot_is_stuck_after_a_time_and_again() -> None:
    (when,) = stuck_at(0.0, 0.0)
    assert StuckSettings.time - 1e-9 <= when <= StuckSettings.time + 0.1


def test_a_driving_or_turning_robot_is_not_stuck() -> None:
    assert stuck_at(0.1, 0.0) == []
    assert stuck_at(0.0, 0.3) == []


def test_a_creeping_robot_is_stuck() -> None:
    assert stuck_at(0.03, 0.0) != []


def test_a_robot_without_a_command_restarts_the_clock() -> None:
    watch, here = StuckDetector(), np.zeros(2)
    assert not watch.update(0.0, here, 0.0)
    watch.reset()
    assert not watch.update(StuckSettings.time, here, 0.0)


class Stubborn:
    """Always choose the same goal, and record the banned goals."""

    finished = False

    def __init__(self) -> None:
        self.banned_goals: list[list[tuple[float, float]]] = []

    def observe(self, scan: LidarScan, world_from_base: SE2) -> None:
        """See nothing new."""

    def known_map(self) -> OccupancyGrid:
        """A hall all free."""
        return OccupancyGrid(GridFrame(0.1, SE2(-5.0, -5.0, 0.0), (100, 100)), np.full((100, 100), -3.0))

    def choose_path(
        self, now: float, grid: OccupancyGrid, routes: Routes, banned: list[NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """The straight way there, whatever is banned."""
        self.banned_goals.append([(float(x), float(y)) for x, y in banned])
        return np.stack((np.linspace(0.0, 3.0, 31), np.zeros(31)), axis=-1)


def test_an_unreachable_goal_is_banned_for_a_while() -> None:
    policy, lidar = Stubborn(), Lidar()
    navigator = Navigator(RobotSettings(lidar), 0, policy, Stopwatch())
    nothing = np.full(lidar.beams, np.inf)
    for now in np.arange(0.0, 22.0, 0.1):
        navigator.command(lidar.scan(float(now), nothing), SE2())  # it is commanded to drive, but does not move
    assert policy.banned_goals[0] == []
    assert (3.0, 0.0) in policy.banned_goals[-1]
    assert len(policy.banned_goals[-1]) <= StuckSettings.ban_time / StuckSettings.time + 1
