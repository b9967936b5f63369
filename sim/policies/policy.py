"""What a robot wants, apart from how it drives there."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.scan import LidarScan
from sim.navigation.routes import Routes

NOWHERE: NDArray[np.float64] = np.empty((0, 2))


class Policy(Protocol):
    """Where a robot wants to go: it knows a map and chooses paths on it."""

    finished: bool
    """Whether the robot has nothing left to do."""

    def look(self, scan: LidarScan, world_from_base: SE2) -> None:
        """Take a scan in."""

    def known(self) -> OccupancyGrid:
        """The map that is known by now."""

    def choose(
        self, now: float, grid: OccupancyGrid, routes: Routes, banned: list[NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """A path, (N, 2) [m], along these routes on this grid to the best goal; (0, 2) where there is none. Goals
        near banned places, (2,), are not to be chosen."""
