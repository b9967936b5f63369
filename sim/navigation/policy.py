"""Define the interface of a policy: it chooses the path, the navigator drives it."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.scan import LidarScan
from sim.navigation.routes import Routes

NO_PATH: NDArray[np.float64] = np.empty((0, 2))


class Policy(Protocol):
    """Keep a map and choose paths on it."""

    finished: bool
    """True if the robot has nothing left to do."""

    def observe(self, scan: LidarScan, world_from_base: SE2) -> None:
        """Process a scan."""

    def known_map(self) -> OccupancyGrid:
        """Return the current map."""

    def choose_path(
        self, now: float, grid: OccupancyGrid, routes: Routes, banned: list[NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Return a path (N, 2) [m] along these routes on this grid to the best goal, (0, 2) if there is none.

        Goals near ``banned`` positions, (2,) each, are excluded.
        """
