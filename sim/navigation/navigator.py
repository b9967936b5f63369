"""Drive one robot: follow paths, avoid obstacles, recover when stuck, and give way to other robots."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.scan import LidarScan
from sim.navigation.avoidance import Avoidance
from sim.navigation.fence import Fence
from sim.navigation.known_free_space import KnownFreeSpace
from sim.navigation.policy import NO_PATH, Policy
from sim.navigation.right_of_way import blocks_path, nearest_robot, retreat_cell, waiting_time, wall_distance
from sim.navigation.routes import Routes
from sim.navigation.settings import NavigationSettings
from sim.navigation.stuck import StuckDetector
from sim.navigation.tracking import Tracker
from sim.physics.robot import RobotSettings
from sim.physics.stopwatch import Stopwatch
from worlds.polygon import Polygon


class Navigator:
    """Steer one robot from its clean scans at true poses.

    ``fence`` is the outline that it must not cross, if there is one. ``rank`` is its number in the team; it breaks ties
    where two robots would wait for each other.
    """

    def __init__(
        self,
        robot: RobotSettings,
        rank: int,
        policy: Policy,
        stopwatch: Stopwatch,
        fence: Polygon | None = None,
        settings: NavigationSettings = NavigationSettings(),
    ) -> None:
        self._robot, self._rank, self._policy, self._stopwatch = robot, rank, policy, stopwatch
        self._settings, self._way = settings, settings.right_of_way
        self._fence = Fence(fence, settings.fence_spacing)
        self._avoidance = Avoidance(robot.limits, robot.radius, settings.steering)
        self._free_space = KnownFreeSpace(settings.free_log_odds)
        self._tracker = Tracker(settings.tracking)
        self._walls = NO_PATH
        sees_all_round = robot.lidar.beams * abs(robot.lidar.angle_increment) > math.tau - math.radians(5.0)
        self._idle_turn = 0.0 if sees_all_round else min(settings.look_around, robot.limits.turn_rate)
        self._path = NO_PATH
        self._planned_at = -math.inf
        self._banned: list[tuple[float, NDArray[np.float64]]] = []
        self._stuck = StuckDetector(settings.stuck)
        self._blocked: tuple[float, NDArray[np.float64], float] | None = None
        self._yielding_since = math.inf
        self._moving = self._commanded = (0.0, 0.0)
        self._stamp = 0.0

    def command(self, scan: LidarScan, world_from_base: SE2) -> tuple[float, float]:
        """Return the (forward speed [m/s], turn rate [rad/s]) to drive until the next scan."""
        if not self._policy.finished:
            with self._stopwatch.measure("mapping"):
                self._policy.observe(scan, world_from_base)
        with self._stopwatch.measure("planning"):
            self._moving = self._robot.limits.ramp(self._moving, self._commanded, scan.stamp - self._stamp)
            self._stamp = scan.stamp
            self._commanded = self._decide(scan, world_from_base)
            return self._commanded

    def _decide(self, scan: LidarScan, world_from_base: SE2) -> tuple[float, float]:
        now, here = scan.stamp, np.array((world_from_base.x, world_from_base.y))
        points = self._robot.lidar.base_from_lidar.apply(scan.points())
        placed = world_from_base.apply(points)
        moving = self._free_space.contains(placed)
        movers = placed[moving]
        drifts = self._tracker.drifts(now, movers, here)
        if self._yielding_since < math.inf:
            self._yield(now, here, movers)
        else:
            self._follow_path(now, here, world_from_base.yaw, movers)
        if len(self._path) == 0:
            return 0.0, 0.0 if self._policy.finished or self._yielding_since < math.inf else self._idle_turn
        seen = self._fence.add_to_points(points, world_from_base)
        ahead = world_from_base.inverse().apply(lookahead_segment(self._path, here, self._settings.lookahead))
        drift = np.zeros_like(seen)
        drift[: len(points)][moving] = SE2(0.0, 0.0, -world_from_base.yaw).apply(drifts)
        return self._avoidance.steer(self._avoidance.choose_target(ahead, seen), seen, self._moving, drift)

    def _follow_path(self, now: float, here: NDArray[np.float64], yaw: float, movers: NDArray[np.float64]) -> None:
        """Wait, give way or plan a new path, as the situation requires."""
        if self._must_wait(now, here, movers):
            self._stuck.reset()
            if now - self._planned_at > self._settings.replan_time and not self._policy.finished:
                self._plan(now, here, NO_PATH)
            return
        if self._yielding_since < math.inf or self._policy.finished:
            return
        if len(self._path) == 0:
            self._stuck.reset()
        elif self._stuck.update(now, here, yaw):
            self._banned.append((now + self._settings.stuck.ban_time, self._path[-1]))
            self._path, self._planned_at = NO_PATH, -math.inf
        arrived = len(self._path) > 0 and math.dist(here, self._path[-1]) < self._settings.arrived
        if arrived or now - self._planned_at > self._settings.replan_time:
            self._plan(now, here, movers)

    def _must_wait(self, now: float, here: NDArray[np.float64], movers: NDArray[np.float64]) -> bool:
        """Return whether to wait for a robot on the path. After the waiting time, start to give way."""
        other = nearest_robot(movers, here, self._robot.radius, self._way)
        if other is None or not (len(self._path) == 0 or blocks_path(self._path, movers, here, self._way)):
            self._blocked = None
            return False
        got_on = self._blocked is None or math.dist(here, self._blocked[1]) > 2.0 * self._settings.stuck.distance
        if self._blocked is None or got_on or self._tracker.passes(here):
            room, other_room = wall_distance(self._walls, here), wall_distance(self._walls, other)
            self._blocked = (now, here, waiting_time(room, other_room, self._rank, self._way))
        if now - self._blocked[0] < self._blocked[2]:
            return True
        self._blocked = None
        grid = self._free_space.static_map(self._known_map(), movers)
        routes = Routes(grid, here, self._robot.radius, self._settings.routes)
        cell = retreat_cell(routes, here, other, self._way)
        if cell is not None:
            self._path, self._yielding_since = routes.path_to(cell), now
        return False

    def _yield(self, now: float, here: NDArray[np.float64], movers: NDArray[np.float64]) -> None:
        """Drive out of the way, and stay there until the other robot has passed."""
        least, most = self._way.yield_time
        if len(self._path) and now - self._yielding_since < most:
            if math.dist(here, self._path[-1]) < self._settings.arrived:
                self._path, self._yielding_since = NO_PATH, now
            return
        aside = now - self._yielding_since
        near = len(movers) > 0 and bool((np.hypot(*(movers - here).T) < self._way.clear_distance).any())
        if aside > most or (aside > least and not near):
            self._yielding_since = math.inf
            self._path, self._planned_at = NO_PATH, -math.inf

    def _plan(self, now: float, here: NDArray[np.float64], movers: NDArray[np.float64]) -> None:
        self._planned_at = now
        known = self._known_map()
        bare = self._free_space.static_map(known, NO_PATH)
        self._walls = bare.frame.metres_from_cells(np.argwhere(bare.occupied))
        self._banned = [ban for ban in self._banned if ban[0] > now]
        self._path = NO_PATH
        if len(movers):
            self._path = self._choose_path(now, here, self._free_space.static_map(known, movers))
        if len(self._path) == 0:  # wait if only another robot blocks the way
            self._path = self._choose_path(now, here, bare)

    def _choose_path(self, now: float, here: NDArray[np.float64], grid: OccupancyGrid) -> NDArray[np.float64]:
        routes = Routes(grid, here, self._robot.radius, self._settings.routes)
        return self._policy.choose_path(now, grid, routes, [place for _, place in self._banned])

    def _known_map(self) -> OccupancyGrid:
        known = self._fence.add_to_grid(self._policy.known_map())
        self._free_space.update(known)
        return known


def lookahead_segment(
    path: NDArray[np.float64], here: NDArray[np.float64], distances: tuple[float, float] = NavigationSettings.lookahead
) -> NDArray[np.float64]:
    """Return the part (M, 2) of a path (N, 2) between two ``distances`` [m] past the point nearest to ``here`` (2,).

    A robot off its path is led back to it.
    """
    off = path - here
    distance = np.hypot(off[:, 0], off[:, 1])
    first = int(np.argmin(distance))
    rest = distance[first:]
    near, far = (int(np.argmax(rest > reach)) if rest.max() > reach else len(rest) - 1 for reach in distances)
    return path[first + near : first + max(near, far) + 1]
