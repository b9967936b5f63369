"""Two robots that meet: right of way, yielding, and progress of both."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.scan import LidarScan
from sim.mission.running import Driven
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from sim.navigation.known_free_space import KnownFreeSpace
from sim.navigation.navigator import Navigator, lookahead_segment
from sim.navigation.right_of_way import blocks_path, retreat_cell, waiting_time, wall_distance
from sim.navigation.routes import Routes
from sim.navigation.tracking import Tracker
from sim.physics.bullet import BulletScene
from sim.physics.drive import DriveLimits
from sim.physics.robot import RobotSettings
from sim.physics.stopwatch import Stopwatch
from sim.policies.explore import FrontierExploration
from sim.sensors.lidar import Lidar
from worlds.polygon import box
from worlds.world import World

NARROW = (box(0, 0, 10, 0.2), box(0, 4.8, 10, 5), box(0, 0, 0.2, 5), box(9.8, 0, 10, 5))
DOOR = (*NARROW, box(4.9, 0, 5.1, 2.0), box(4.9, 2.9, 5.1, 5.0))


@pytest.mark.parametrize("seed", [0, 1])
def test_two_robots_that_meet_in_a_door_both_pass_soon(seed: int) -> None:
    starts = [SE2(2.0, 2.45 + 0.1 * seed), SE2(8.0, 2.45 - 0.1 * seed, math.pi)]
    goals = [(8.5, 2.5), (1.5, 2.5)]
    world = World("door", 0, (10.0, 5.0), DOOR)
    settings = MissionSettings([RobotSettings(start=start) for start in starts], 30.0, policy="patrol", goals=goals)
    mission, _ = simulate(world, settings, 0)
    assert mission.contacts == (0, 0)
    first, second = (truth.trajectory.poses[:, 0] for truth in mission.robots)
    assert first[:240].max() > 5.5
    assert second[:240].min() < 4.5


def test_the_robot_with_less_room_waits_longer_and_ties_are_broken() -> None:
    assert waiting_time(1.0, 0.5, 0) < waiting_time(0.7, 0.7, 0) < waiting_time(0.5, 1.0, 0)
    assert waiting_time(0.7, 0.7, 0) < waiting_time(0.7, 0.7, 1)


def test_room_is_the_distance_to_the_nearest_wall() -> None:
    assert wall_distance(np.array([(0.0, 0.0), (3.0, 4.0)]), np.array((3.0, 0.0))) == pytest.approx(3.0)
    assert wall_distance(np.empty((0, 2)), np.zeros(2)) == math.inf


def test_only_robots_near_the_path_block_it() -> None:
    path = np.stack((np.linspace(0.0, 5.0, 51), np.zeros(51)), axis=-1)
    here = np.zeros(2)
    assert blocks_path(path, np.array([(0.8, 0.1)]), here)
    assert not blocks_path(path, np.array([(0.1, 0.9)]), here)
    assert not blocks_path(path, np.array([(3.0, 0.0)]), here)
    assert not blocks_path(path, np.empty((0, 2)), here)


def test_a_robot_yields_beside_the_path_and_keeps_its_distance() -> None:
    occupancy = np.full((60, 80), 100, dtype=np.int8)
    occupancy[1:-1, 1:-1] = 0
    grid = OccupancyGrid.from_occupancy(GridFrame(0.1, SE2(), (60, 80)), occupancy)
    here, other = np.array((4.0, 3.0)), np.array((5.0, 3.0))
    cell = retreat_cell(Routes(grid, here, 0.2), here, other)
    assert cell is not None
    x, y = grid.frame.metres_from_cells(cell)
    assert abs(y - 3.0) > 0.7
    assert math.dist((x, y), other) > 1.0


def test_moving_robots_leave_no_obstacles_behind() -> None:
    frame = GridFrame(0.1, SE2(), (40, 40))
    occupancy = np.zeros((40, 40), dtype=np.int8)
    occupancy[:, 30] = 100
    floor = KnownFreeSpace()
    floor.update(OccupancyGrid.from_occupancy(frame, occupancy))
    points = np.array([(1.05, 1.05), (3.05, 1.05), (2.95, 1.05), (9.0, 9.0)])
    assert floor.contains(points).tolist() == [True, False, False, False]
    larger = GridFrame(0.1, SE2(-1.0, -2.0), (80, 80))
    mapped = np.full((80, 80), -1, dtype=np.int8)
    mapped[20:60, 10:50] = occupancy
    mapped[30:33, 20:23] = 100  # a robot that passed by
    grid = OccupancyGrid.from_occupancy(larger, mapped)
    floor.update(grid)
    bare = floor.static_map(grid, np.empty((0, 2)))
    assert not bare.occupied[30:33, 20:23].any()
    assert bare.occupied[20:60, 40].all()
    assert floor.static_map(grid, points[:1]).occupied[30, 20]


def test_the_tracker_estimates_a_constant_velocity_and_resets_after_a_jump() -> None:
    tracker, arc = Tracker(), np.array([(1.0, -0.1), (0.95, 0.0), (1.0, 0.1)])
    for k in range(12):
        drifts = tracker.drifts(0.1 * k, np.concatenate((arc - (0.04 * k, 0.0), [(9.0, 9.0)])), np.zeros(2))
    assert drifts[:3] == pytest.approx(np.tile((-0.4, 0.0), (3, 1)), abs=1e-3)
    assert drifts[3].tolist() == [0.0, 0.0]
    assert not tracker.drifts(1.2, arc + np.array((3.0, 0.0)), np.zeros(2)).any()


def test_a_robot_off_its_path_returns_to_the_path() -> None:
    path = np.stack((np.linspace(0.0, 5.0, 51), np.zeros(51)), axis=-1)
    on_it, beside, far = (lookahead_segment(path, np.array(here)) for here in ((1.0, 0.0), (1.0, 0.5), (1.0, 2.0)))
    assert on_it[[0, -1], 0] == pytest.approx((1.3, 2.0), abs=0.11)
    assert beside[[0, -1], 0] == pytest.approx((1.0, 1.8), abs=0.11)
    assert far[[0, -1], 0] == pytest.approx((1.0, 1.0), abs=0.11)
    assert lookahead_segment(path, np.array((4.9, 0.0)))[-1, 0] == pytest.approx(5.0)


class Parked:
    """Stays where it is put."""

    def command(self, scan: LidarScan, world_from_base: SE2) -> tuple[float, float]:
        """Stand still."""
        return 0.0, 0.0


def test_a_blocked_robot_waits_until_the_door_is_free() -> None:
    world, lidar, door, away = World("door", 0, (10.0, 5.0), DOOR), Lidar(), SE2(5.0, 2.45), SE2(8.5, 1.0)
    policy = FrontierExploration(lidar)
    navigator = Navigator(RobotSettings(lidar, DriveLimits(speed=0.3)), 0, policy, Stopwatch())
    with BulletScene(world, [SE2(2.0, 1.2), away]) as scene:
        mover = Driven(scene, "velocity", [navigator, Parked()], Stopwatch())
        for tick in range(600):
            if tick in (60, 360):
                scene.set_poses([scene.pose(0), door if tick == 60 else away])
            scan = lidar.scan(tick / 10.0, scene.cast(0, lidar)[0])
            mover.advance(tick / 10.0, 0.1, [mover.decide(0, scan, scene.pose(0)), (0.0, 0.0)])
            if tick == 359:
                assert scene.pose(0).x < 5.0
                assert not policy.finished
            if scene.pose(0).x > 5.5:
                break
    assert 360 < tick < 599
