"""Explore alone, on a map of the robot's own."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.log_odds import LogOddsMapper
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.scan import LidarScan
from sim.navigation.policy import NO_PATH
from sim.navigation.routes import Routes
from sim.policies.frontiers import Viewpoints, viewpoints
from sim.policies.settings import ExplorationSettings
from sim.sensors.lidar import Lidar


class FrontierExploration:
    """Drive to the viewpoint with the most visible unknown floor per path length.

    ``heading`` [rad] in the world is the direction to explore first, so that robots that start together spread without
    communication. ``finished`` is True when no reachable viewpoint is left.
    """

    def __init__(
        self, lidar: Lidar, heading: float | None = None, settings: ExplorationSettings = ExplorationSettings()
    ) -> None:
        self._lidar, self._heading, self._settings = lidar, heading, settings
        self._mapper = LogOddsMapper(
            settings.map_cell, clear_range=lidar.range_max
        )  # a clean beam without echo saw free
        self._mapped_at = -math.inf
        self._worth_at = 0.0
        self._visited: list[NDArray[np.float64]] = []
        self._goal: NDArray[np.float64] | None = None
        self.finished = False

    def observe(self, scan: LidarScan, world_from_base: SE2) -> None:
        """Map the scan if the last mapped one is old enough."""
        here = np.array((world_from_base.x, world_from_base.y))
        if not self._visited or math.dist(here, self._visited[-1]) > self._settings.visited_radius / 4.0:
            self._visited.append(here)
        if scan.stamp - self._mapped_at > self._settings.map_period - 1e-6:
            self._mapped_at = scan.stamp
            self._mapper.integrate(scan, world_from_base @ self._lidar.base_from_lidar)

    def known_map(self) -> OccupancyGrid:
        """Return the map so far."""
        return self._mapper.grid()

    def choose_path(
        self, now: float, grid: OccupancyGrid, routes: Routes, banned: list[NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Return the path to the viewpoint of greatest utility, (0, 2) if there is none."""
        settings = self._settings
        views = viewpoints(grid, routes, settings.frontiers)
        places = grid.frame.metres_from_cells(views.cells)
        worth = (views.gain >= settings.min_area) & _are_away(places, self._visited, settings.visited_radius)
        allowed = worth & _are_away(places, banned, settings.same_goal)
        if worth.any():
            self._worth_at = now
        self.finished = now - self._worth_at > settings.patience
        if not allowed.any():
            self._goal = None
            return NO_PATH
        best = int(np.argmax(np.where(allowed, self._utility(views, places), -math.inf)))
        self._goal = places[best]
        return routes.path_to(views.cells[best])

    def _utility(self, views: Viewpoints, places: NDArray[np.float64]) -> NDArray[np.float64]:
        utility, settings = views.gain / (1.0 + views.cost), self._settings
        if self._goal is not None:
            utility = np.where(
                _are_away(places, [self._goal], settings.same_goal), utility, settings.persistence * utility
            )
        if self._heading is not None:
            off = places - self._visited[0]
            utility = utility * (
                1.0 + settings.heading_weight * np.cos(np.arctan2(off[:, 1], off[:, 0]) - self._heading)
            )
        return utility


def _are_away(places: NDArray[np.float64], others: list[NDArray[np.float64]], distance: float) -> NDArray[np.bool_]:
    """Return which of the places (N, 2) lie at least ``distance`` [m] from all ``others``, (2,) each: (N,)."""
    gaps = places[:, None] - np.array(others).reshape(-1, 2)
    return np.asarray((np.hypot(gaps[..., 0], gaps[..., 1]) >= distance).all(axis=1))
