"""What each robot saw, slice of time by slice, so that however a mission is cut, no scan is looked at twice."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mapping.grid.frame import GridFrame
from mapping.ground_truth.footprint import observed
from sim.mission.mission import Mission


def part_bounds(scans: int, part: int, parts: int) -> tuple[int, int]:
    """The first scan of a part, and the first after it, where a robot's scans are cut in time into equal parts."""
    return scans * part // parts, scans * (part + 1) // parts


class SeenSlices:
    """A mission whose robots' time is going to be cut into equal parts in several ways, ``cuts`` into how many each.

    ``clear_range`` [m] is how far beams without a return clear.
    """

    def __init__(self, mission: Mission, cuts: Iterable[int], clear_range: float = 0.0) -> None:
        self.clear_range = clear_range
        self._robots = mission.robots
        self._cuts = tuple(cuts)
        self._slices: dict[tuple[int, int, int], NDArray[np.bool_]] = {}

    def seen(self, robot: int, start: int, stop: int, world: GridFrame) -> NDArray[np.bool_]:
        """Which cells of the world's raster a robot saw from scan ``start`` to ``stop - 1``, both of which its time is
        cut at: (rows, cols)."""
        scans = len(self._robots[robot].scans)
        bounds = {bound for parts in self._cuts for part in range(parts) for bound in part_bounds(scans, part, parts)}
        within = sorted(bound for bound in bounds if start <= bound <= stop)
        seen = np.zeros(world.shape, np.bool_)
        for first, last in pairwise(within):
            seen |= self._slice(robot, first, last, world)
        return seen

    def _slice(self, robot: int, start: int, stop: int, world: GridFrame) -> NDArray[np.bool_]:
        key = (robot, start, stop)
        if key not in self._slices:
            self._slices[key] = observed(self._robots[robot].part(start, stop), world, self.clear_range)
        return self._slices[key]
