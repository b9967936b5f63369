"""A robot that explores alone, on a map of its own."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from mapping.log_odds import LogOddsMapper
from mapping.scan import LidarScan
from mapping.se2 import SE2
from sim.avoidance import Avoidance
from sim.drive import DriveLimits
from sim.fence import Fence
from sim.frontiers import viewpoints
from sim.lidar import Lidar
from sim.routes import Routes
from sim.stopwatch import Stopwatch
from worlds.polygon import Polygon

CELL = 0.1
"""Resolution of the map that a robot plans on [m]."""
MAPPED = 0.2
"""Least time between two scans that go into that map [s]; steering looks at every scan."""
REPLAN = 2.5
"""Longest time that a plan is kept [s]."""
LOOKAHEAD = (0.2, 0.9)
"""How near and how far ahead on its path a robot aims [m]."""
ARRIVED = 0.3
"""Distance at which a viewpoint counts as reached [m]."""
SEEN_FROM = 0.4
"""Nearer than this to where the robot has been [m], there is nothing new to see: gaps in mapped walls only look so."""
PERSISTENCE = 1.5
"""How much more the present goal counts than another, so that a robot does not waver."""
MIN_GAIN = 0.4
"""Unknown floor [m^2] that is worth no trip."""
PATIENCE = 15.0
"""A robot that has found nothing to see for this long [s] has finished; before, another may only stand in its way."""
STUCK_TIME, STUCK_DISTANCE = 3.0, 0.15
"""A robot that got no farther than this [m] in this time [s] on its way is stuck."""
LOOK_AROUND = 0.6
"""A robot that has nowhere to go and does not see all round turns this fast [rad/s]: once round in its patience."""
BAN_TIME, BAN_RADIUS = 15.0, 0.7
"""For this time [s], a viewpoint this near [m] to one that could not be reached is not tried again."""


class Explorer:
    """Plans and steers one robot from its clean scans at true poses; all it hears of the world is the ``fence``, if
    there is one, that it must not cross.

    It drives to where it expects the most unknown floor for the way, avoids what its lidar sees now, other robots
    among it, gives a goal up for a while when it is stuck, and is ``finished`` when nothing reachable is left.
    """

    def __init__(
        self,
        lidar: Lidar,
        limits: DriveLimits,
        radius: float,
        stopwatch: Stopwatch,
        fence: Polygon | None = None,
    ) -> None:
        self._fence = Fence(fence)
        self._lidar = lidar
        self._radius = radius
        self._stopwatch = stopwatch
        self._mapper = LogOddsMapper(CELL, clear_range=lidar.range_max)  # a clean beam without echo saw free floor
        self._avoidance = Avoidance(limits, radius)
        sees_all_round = lidar.beams * abs(lidar.angle_increment) > math.tau - math.radians(5.0)
        self._idle_turn = 0.0 if sees_all_round else min(LOOK_AROUND, limits.turn_rate)
        self._path: NDArray[np.float64] = np.empty((0, 2))
        self._planned_at = self._mapped_at = -math.inf
        self._worth_at = 0.0
        self._banned: list[tuple[float, NDArray[np.float64]]] = []
        self._past: deque[tuple[float, NDArray[np.float64]]] = deque()
        self._been: list[NDArray[np.float64]] = []
        self.finished = False

    def command(self, scan: LidarScan, world_from_base: SE2) -> tuple[float, float]:
        """The (forward speed [m/s], turn rate [rad/s]) to drive until the next scan."""
        if self.finished:
            return 0.0, 0.0
        if scan.stamp - self._mapped_at > MAPPED - 1e-6:
            self._mapped_at = scan.stamp
            with self._stopwatch.on("mapping"):
                self._mapper.integrate(scan, world_from_base @ self._lidar.base_from_lidar)
        with self._stopwatch.on("planning"):
            return self._command(scan, world_from_base)

    def _command(self, scan: LidarScan, world_from_base: SE2) -> tuple[float, float]:
        here = np.array((world_from_base.x, world_from_base.y))
        if not self._been or math.dist(here, self._been[-1]) > SEEN_FROM / 4.0:
            self._been.append(here)
        if self._is_stuck(scan.stamp, here):
            self._banned.append((scan.stamp + BAN_TIME, self._path[-1]))
            self._path = self._path[:0]
            self._planned_at = -math.inf
        arrived = len(self._path) > 0 and math.dist(here, self._path[-1]) < ARRIVED
        if arrived or scan.stamp - self._planned_at > REPLAN:
            self._plan(scan.stamp, here)
        if len(self._path) == 0:
            return 0.0, self._idle_turn
        seen = self._fence.beside(self._lidar.base_from_lidar.apply(scan.points()), world_from_base)
        ahead = world_from_base.inverse().apply(_ahead(self._path, here))
        return self._avoidance.steer(self._avoidance.aim(ahead, seen), seen)

    def _plan(self, now: float, here: NDArray[np.float64]) -> None:
        """Take the path to the viewpoint of greatest gain over way; without any, the robot waits or has finished."""
        self._planned_at = now
        grid = self._fence.drawn_into(self._mapper.grid())
        routes = Routes(grid, here, self._radius)
        views = viewpoints(grid, routes)
        self._banned = [ban for ban in self._banned if ban[0] > now]
        places = grid.frame.metres_from_cells(views.cells)
        worth = (views.gain >= MIN_GAIN) & _are_away(places, self._been, SEEN_FROM)
        allowed = worth & _are_away(places, [place for _, place in self._banned], BAN_RADIUS)
        present = ~_are_away(places, [self._path[-1]] if len(self._path) else [], BAN_RADIUS)
        if worth.any():
            self._worth_at = now
        self.finished = now - self._worth_at > PATIENCE
        self._path = np.empty((0, 2))
        if allowed.any():
            utility = views.gain / (1.0 + views.cost) * np.where(present, PERSISTENCE, 1.0)
            self._path = routes.path_to(views.cells[int(np.argmax(np.where(allowed, utility, -math.inf)))])

    def _is_stuck(self, now: float, here: NDArray[np.float64]) -> bool:
        if len(self._path) == 0:
            self._past.clear()
            return False
        self._past.append((now, here))
        if now - self._past[0][0] < STUCK_TIME:
            return False
        while now - self._past[0][0] > STUCK_TIME:
            self._past.popleft()
        stuck = all(math.dist(here, place) < STUCK_DISTANCE for _, place in self._past)
        if stuck:
            self._past.clear()
        return stuck


def _are_away(places: NDArray[np.float64], others: list[NDArray[np.float64]], distance: float) -> NDArray[np.bool_]:
    """Which of the places, (N, 2), lie at least that far [m] from all others, (2,) each: (N,)."""
    gaps = places[:, None] - np.array(others).reshape(-1, 2)
    return np.asarray((np.hypot(gaps[..., 0], gaps[..., 1]) >= distance).all(axis=1))


def _ahead(path: NDArray[np.float64], here: NDArray[np.float64]) -> NDArray[np.float64]:
    """The stretch of the path between two distances past the point nearest to the robot, (N, 2)."""
    rest = path[int(np.argmin(np.hypot(*(path - here).T))) :]
    distance = np.hypot(*(rest - here).T)
    near, far = (int(np.argmax(distance > reach)) or len(rest) - 1 for reach in LOOKAHEAD)
    return rest[near : max(near, far) + 1]
