"""A robot on patrol: it knows the place and drives from goal to goal."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mapping.geometry.se2 import SE2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.scan import LidarScan
from sim.mission.start_draws import CELL
from sim.navigation.navigator import ARRIVED
from sim.navigation.routes import Routes
from sim.policies.policy import NOWHERE
from worlds.floor import find_floor
from worlds.raster import true_raster
from worlds.world import World

GOALS = 8
"""How many goals a robot draws that was given none."""

REACHED = ARRIVED + CELL
"""Distance [m] at which a goal counts as reached: its path ends in the middle of its cell."""

Goal = tuple[float, float]
"""x, y in the world [m]."""


class Patrol:
    """Drives to ``goals`` in turn, beginning with number ``first``, round and round; one that cannot be reached now
    is left out. The walls are known beforehand from ``plan``, the true raster; what moves is seen by the lidar."""

    def __init__(self, plan: OccupancyGrid, goals: Sequence[Goal], first: int = 0) -> None:
        self._plan = plan
        self.goals = tuple(goals)
        self._places = [np.array(goal) for goal in goals]
        self._next = first % len(goals)
        self._here = np.zeros(2)
        self.finished = False

    def look(self, scan: LidarScan, world_from_base: SE2) -> None:
        """Note where the robot is."""
        self._here = np.array((world_from_base.x, world_from_base.y))

    def known(self) -> OccupancyGrid:
        """The floor plan."""
        return self._plan

    def choose(
        self, now: float, grid: OccupancyGrid, routes: Routes, banned: list[NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """The path to the present goal, or to the next one once it is reached; (0, 2) where all are out of reach."""
        if self._is_at(self._places[self._next]):
            self._next = (self._next + 1) % len(self._places)
        for step in range(len(self._places)):
            number = (self._next + step) % len(self._places)
            goal = self._places[number]
            cell = grid.frame.cells_from_metres(goal[None])[0]
            tried = any(math.dist(goal, place) < REACHED for place in banned)
            if not tried and not self._is_at(goal) and np.isfinite(routes.costs[tuple(cell)]):
                self._next = number
                return routes.path_to(cell)
        return NOWHERE

    def _is_at(self, goal: NDArray[np.float64]) -> bool:
        return math.dist(self._here, goal) < REACHED


def floor_plan(world: World) -> OccupancyGrid:
    """The walls as a robot on patrol knows them."""
    return true_raster(world, CELL)


def check_goals(world: World, goals: Sequence[Goal], starts: Sequence[SE2], radius: float) -> None:
    """Raise ``ValueError`` naming a goal that robots of ``radius`` [m] cannot drive to from their starts, and why."""
    floor = find_floor(world, radius + CELL, CELL)
    reached = {int(floor.part[cell]) for cell in _cells(floor.part, floor.frame.cells_from_metres(_places(starts)))}
    for index, (x, y) in enumerate(goals):
        told = f"goal {index} at ({x:g}, {y:g})"
        fault = world.fault_at(x, y)
        if fault is not None:
            raise ValueError(f"{told} is {fault}")
        (cell,) = _cells(floor.part, floor.frame.cells_from_metres([(x, y)]))
        if floor.part[cell] == 0:
            raise ValueError(
                f"{told} is {world.clearance([(x, y)])[0]:.2f} m from {world.bounds} of world {world.name!r}: too "
                f"narrow for a radius of {radius:g} m"
            )
        if reached - {0} and int(floor.part[cell]) not in reached:
            raise ValueError(f"{told} is in a part of world {world.name!r} that no robot starts in")


def draw_goals(rng: np.random.Generator, world: World, start: SE2, radius: float) -> tuple[Goal, ...]:
    """Places that a robot of ``radius`` [m] can drive to from its start, drawn evenly from the floor.

    Raises ``ValueError`` where it stands nowhere.
    """
    floor = find_floor(world, radius + 2.0 * CELL, CELL)
    (cell,) = _cells(floor.part, floor.frame.cells_from_metres(_places([start])))
    if floor.part[cell] == 0:
        nearest = ndimage.distance_transform_edt(floor.part == 0, return_distances=False, return_indices=True)
        cell = (int(nearest[0][cell]), int(nearest[1][cell]))
    members = np.argwhere(floor.part == floor.part[cell])
    if floor.part[cell] == 0 or len(members) == 0:
        raise ValueError(f"world {world.name!r} has no floor for a tour of a robot of {radius:g} m radius")
    drawn = members[rng.integers(len(members), size=GOALS)]
    return tuple((float(x), float(y)) for x, y in floor.frame.metres_from_cells(drawn))


def _places(starts: Sequence[SE2]) -> NDArray[np.float64]:
    return np.array([(start.x, start.y) for start in starts])


def _cells(part: NDArray[np.int64], cells: NDArray[np.int64]) -> list[tuple[int, int]]:
    clipped = np.clip(cells, 0, np.array(part.shape) - 1)
    return [(int(row), int(col)) for row, col in clipped]
