"""One robot at the wheel: it follows paths, avoids what it sees, gets itself unstuck, and makes way for others."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.scan import LidarScan
from sim.mission.robot import RobotSettings
from sim.navigation.avoidance import Avoidance
from sim.navigation.fence import Fence
from sim.navigation.known_floor import KnownFloor
from sim.navigation.right_of_way import in_the_way, nearest, patience, retreat, room_at
from sim.navigation.routes import Routes
from sim.navigation.stuck import STUCK_DISTANCE, StuckWatch
from sim.navigation.tracking import Tracker
from sim.physics.stopwatch import Stopwatch
from sim.policies.policy import NOWHERE, Policy
from worlds.polygon import Polygon

REPLAN = 2.5
"""Longest time that a plan is kept [s]."""
LOOKAHEAD = (0.2, 0.9)
"""How near and how far ahead on its path a robot aims [m]."""
ARRIVED = 0.3
"""Distance at which the end of a path counts as reached [m]."""
BAN_TIME = 15.0
"""For this time [s], a goal that could not be reached is not tried again."""
LEAST_ASIDE, MOST_ASIDE, CLEAR_OF = 3.0, 8.0, 1.6
"""A robot that gave way stands aside for at least and at most this long [s], in between until none is this near [m]."""
LOOK_AROUND = 0.6
"""A robot that has nowhere to go and does not see all round turns this fast [rad/s]."""


class Navigator:
    """Steers one robot from its clean scans at true poses; all it hears of the world is the ``fence``, if there is
    one, that it must not cross. ``rank`` is its number in the team, by which equals do not wait for each other."""

    def __init__(
        self, robot: RobotSettings, rank: int, policy: Policy, stopwatch: Stopwatch, fence: Polygon | None = None
    ) -> None:
        self._robot, self._rank, self._policy, self._stopwatch = robot, rank, policy, stopwatch
        self._fence = Fence(fence)
        self._avoidance = Avoidance(robot.limits, robot.radius)
        self._floor = KnownFloor()
        self._tracker = Tracker()
        self._walls = NOWHERE
        sees_all_round = robot.lidar.beams * abs(robot.lidar.angle_increment) > math.tau - math.radians(5.0)
        self._idle_turn = 0.0 if sees_all_round else min(LOOK_AROUND, robot.limits.turn_rate)
        self._path = NOWHERE
        self._planned_at = -math.inf
        self._banned: list[tuple[float, NDArray[np.float64]]] = []
        self._stuck = StuckWatch()
        self._blocked: tuple[float, NDArray[np.float64], float] | None = None
        self._aside_since = math.inf
        self._moving = self._commanded = (0.0, 0.0)
        self._stamp = 0.0

    def command(self, scan: LidarScan, world_from_base: SE2) -> tuple[float, float]:
        """The (forward speed [m/s], turn rate [rad/s]) to drive until the next scan."""
        if not self._policy.finished:
            with self._stopwatch.on("mapping"):
                self._policy.look(scan, world_from_base)
        with self._stopwatch.on("planning"):
            self._moving = self._robot.limits.ramped(self._moving, self._commanded, scan.stamp - self._stamp)
            self._stamp = scan.stamp
            self._commanded = self._decide(scan, world_from_base)
            return self._commanded

    def _decide(self, scan: LidarScan, world_from_base: SE2) -> tuple[float, float]:
        now, here = scan.stamp, np.array((world_from_base.x, world_from_base.y))
        points = self._robot.lidar.base_from_lidar.apply(scan.points())
        placed = world_from_base.apply(points)
        moving = self._floor.holds(placed)
        movers = placed[moving]
        drifts = self._tracker.drifts(now, movers, here)
        if self._aside_since < math.inf:
            self._stand_aside(now, here, movers)
        else:
            self._mind_the_way(now, here, world_from_base.yaw, movers)
        if len(self._path) == 0:
            return 0.0, 0.0 if self._policy.finished or self._aside_since < math.inf else self._idle_turn
        seen = self._fence.beside(points, world_from_base)
        ahead = world_from_base.inverse().apply(stretch_ahead(self._path, here))
        drift = np.zeros_like(seen)
        drift[: len(points)][moving] = SE2(0.0, 0.0, -world_from_base.yaw).apply(drifts)
        return self._avoidance.steer(self._avoidance.aim(ahead, seen), seen, self._moving, drift)

    def _mind_the_way(self, now: float, here: NDArray[np.float64], yaw: float, movers: NDArray[np.float64]) -> None:
        """Wait, make way or plan anew as things stand."""
        if self._waits(now, here, movers):
            self._stuck.forget()
            if now - self._planned_at > REPLAN and not self._policy.finished:
                self._plan(now, here, NOWHERE)
            return
        if self._aside_since < math.inf or self._policy.finished:
            return
        if len(self._path) == 0:
            self._stuck.forget()
        elif self._stuck.notes(now, here, yaw):
            self._banned.append((now + BAN_TIME, self._path[-1]))
            self._path, self._planned_at = NOWHERE, -math.inf
        arrived = len(self._path) > 0 and math.dist(here, self._path[-1]) < ARRIVED
        if arrived or now - self._planned_at > REPLAN:
            self._plan(now, here, movers)

    def _waits(self, now: float, here: NDArray[np.float64], movers: NDArray[np.float64]) -> bool:
        """Whether another stands in the way and is waited for; whoever has waited long enough gives way."""
        other = nearest(movers, here, self._robot.radius)
        if other is None or not (len(self._path) == 0 or in_the_way(self._path, movers, here)):
            self._blocked = None
            return False
        got_on = self._blocked is None or math.dist(here, self._blocked[1]) > 2.0 * STUCK_DISTANCE
        if self._blocked is None or got_on or self._tracker.passes(here):
            room, other_room = room_at(self._walls, here), room_at(self._walls, other)
            self._blocked = (now, here, patience(room, other_room, self._rank))
        if now - self._blocked[0] < self._blocked[2]:
            return True
        self._blocked = None
        grid = self._floor.without_movers(self._known(), movers)
        routes = Routes(grid, here, self._robot.radius)
        cell = retreat(routes, here, other)
        if cell is not None:
            self._path, self._aside_since = routes.path_to(cell), now
        return False

    def _stand_aside(self, now: float, here: NDArray[np.float64], movers: NDArray[np.float64]) -> None:
        """Get out of the way, and stay there until the other has passed."""
        if len(self._path) and now - self._aside_since < MOST_ASIDE:
            if math.dist(here, self._path[-1]) < ARRIVED:
                self._path, self._aside_since = NOWHERE, now
            return
        aside = now - self._aside_since
        near = len(movers) > 0 and bool((np.hypot(*(movers - here).T) < CLEAR_OF).any())
        if aside > MOST_ASIDE or (aside > LEAST_ASIDE and not near):
            self._aside_since = math.inf
            self._path, self._planned_at = NOWHERE, -math.inf

    def _plan(self, now: float, here: NDArray[np.float64], movers: NDArray[np.float64]) -> None:
        self._planned_at = now
        known = self._known()
        bare = self._floor.without_movers(known, NOWHERE)
        self._walls = bare.frame.metres_from_cells(np.argwhere(bare.occupied))
        self._banned = [ban for ban in self._banned if ban[0] > now]
        self._path = NOWHERE
        if len(movers):
            self._path = self._chosen(now, here, self._floor.without_movers(known, movers))
        if len(self._path) == 0:  # what is shut only by another robot is waited for
            self._path = self._chosen(now, here, bare)

    def _chosen(self, now: float, here: NDArray[np.float64], grid: OccupancyGrid) -> NDArray[np.float64]:
        routes = Routes(grid, here, self._robot.radius)
        return self._policy.choose(now, grid, routes, [place for _, place in self._banned])

    def _known(self) -> OccupancyGrid:
        known = self._fence.drawn_into(self._policy.known())
        self._floor.learn(known)
        return known


def stretch_ahead(path: NDArray[np.float64], here: NDArray[np.float64]) -> NDArray[np.float64]:
    """The stretch, (M, 2), of a path, (N, 2), from its first to its second lookahead past the point nearest to a robot
    ``here``, (2,); a robot that is off its path is led back to it."""
    off = path - here
    distance = np.hypot(off[:, 0], off[:, 1])
    first = int(np.argmin(distance))
    rest = distance[first:]
    near, far = (int(np.argmax(rest > reach)) if rest.max() > reach else len(rest) - 1 for reach in LOOKAHEAD)
    return path[first + near : first + max(near, far) + 1]
