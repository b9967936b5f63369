"""A robot that explores alone, on a map of its own."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.log_odds import LogOddsMapper
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.scan import LidarScan
from sim.navigation.routes import Routes
from sim.policies.frontiers import Viewpoints, viewpoints
from sim.policies.policy import NOWHERE
from sim.sensors.lidar import Lidar

CELL = 0.1
"""Resolution of the map that a robot plans on [m]."""
MAPPED = 0.2
"""Least time between two scans that go into that map [s]; steering looks at every scan."""
SEEN_FROM = 0.4
"""Nearer than this to where the robot has been [m], there is nothing new to see: gaps in mapped walls only look so."""
PERSISTENCE = 1.5
"""How much more the present goal counts than another, so that a robot does not waver."""
SAME_GOAL = 0.7
"""Viewpoints this near to one another [m] count as one."""
OWN_SIDE = 0.6
"""How much more a viewpoint counts that lies where the robot was sent, and less where it lies opposite."""
MIN_GAIN = 0.4
"""Unknown floor [m^2] that is worth no trip."""
PATIENCE = 15.0
"""A robot that has found nothing to see for this long [s] has finished."""


class FrontierExploration:
    """Drives to where it expects the most unknown floor for the way; ``finished`` when nothing reachable is left.

    ``heading`` [rad] in the world is the side that the robot was told to see first; a team that starts together
    spreads so without a word.
    """

    def __init__(self, lidar: Lidar, heading: float | None = None) -> None:
        self._lidar, self._heading = lidar, heading
        self._mapper = LogOddsMapper(CELL, clear_range=lidar.range_max)  # a clean beam without echo saw free floor
        self._mapped_at = -math.inf
        self._worth_at = 0.0
        self._been: list[NDArray[np.float64]] = []
        self._goal: NDArray[np.float64] | None = None
        self.finished = False

    def look(self, scan: LidarScan, world_from_base: SE2) -> None:
        """Map the scan, if the last one is some time ago."""
        here = np.array((world_from_base.x, world_from_base.y))
        if not self._been or math.dist(here, self._been[-1]) > SEEN_FROM / 4.0:
            self._been.append(here)
        if scan.stamp - self._mapped_at > MAPPED - 1e-6:
            self._mapped_at = scan.stamp
            self._mapper.integrate(scan, world_from_base @ self._lidar.base_from_lidar)

    def known(self) -> OccupancyGrid:
        """The map so far."""
        return self._mapper.grid()

    def choose(
        self, now: float, grid: OccupancyGrid, routes: Routes, banned: list[NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """The path to the viewpoint of greatest gain over way; without any, the robot waits or has finished."""
        views = viewpoints(grid, routes)
        places = grid.frame.metres_from_cells(views.cells)
        worth = (views.gain >= MIN_GAIN) & _are_away(places, self._been, SEEN_FROM)
        allowed = worth & _are_away(places, banned, SAME_GOAL)
        if worth.any():
            self._worth_at = now
        self.finished = now - self._worth_at > PATIENCE
        if not allowed.any():
            self._goal = None
            return NOWHERE
        best = int(np.argmax(np.where(allowed, self._utility(views, places), -math.inf)))
        self._goal = places[best]
        return routes.path_to(views.cells[best])

    def _utility(self, views: Viewpoints, places: NDArray[np.float64]) -> NDArray[np.float64]:
        utility = views.gain / (1.0 + views.cost)
        if self._goal is not None:
            utility = np.where(_are_away(places, [self._goal], SAME_GOAL), utility, PERSISTENCE * utility)
        if self._heading is not None:
            off = places - self._been[0]
            utility = utility * (1.0 + OWN_SIDE * np.cos(np.arctan2(off[:, 1], off[:, 0]) - self._heading))
        return utility


def _are_away(places: NDArray[np.float64], others: list[NDArray[np.float64]], distance: float) -> NDArray[np.bool_]:
    """Which of the places, (N, 2), lie at least that far [m] from all others, (2,) each: (N,)."""
    gaps = places[:, None] - np.array(others).reshape(-1, 2)
    return np.asarray((np.hypot(gaps[..., 0], gaps[..., 1]) >= distance).all(axis=1))
