"""The bend of a map in a merged map."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.arrays import frozen_array
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.records.bend import Bend


@dataclass(frozen=True, eq=False)
class BentMap:
    """How a map was bent before its transform was applied and it was fused.

    - ``bend``: in cells of the map, from its lower left corner;
    - ``largest_bend``: how far it moves a wall of the map, beyond one rigid motion of all [stated metres of the map];
    - ``straightened``: the map was straightened by its own walls first (``straighten``).
    """

    bend: Bend
    largest_bend: float
    straightened: bool

    @property
    def strain(self) -> float:
        """Root mean square of the strain, without unit; its square is the elastic energy, up to the stiffness."""
        return self.bend.strain


def bent_grid(grid: OccupancyGrid, bend: Bend) -> OccupancyGrid:
    """Bend the known part of a map, by a bend in its cells, and grow it by what leaves it."""
    grown = grid.cropped(math.ceil(float(np.abs(bend.nodes).max())) + 1)
    there = np.array([[grown.frame.origin.x, grown.frame.origin.y]])
    offset = np.rint(grid.frame.origin.inverse().apply(there)[0] / grid.frame.resolution)
    return Bend(frozen_array(bend.corner - offset, np.float64), bend.spacing, bend.nodes).resample(grown).cropped()
