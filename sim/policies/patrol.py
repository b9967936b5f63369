"""Patrol between goals in a known world."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mapping.geometry.se2 import SE2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.scan import LidarScan
from sim.navigation.policy import NO_PATH
from sim.navigation.routes import Routes
from sim.policies.settings import BehaviourSettings, PatrolSettings
from worlds.floor import find_floor
from worlds.world import World

Goal = tuple[float, float]
"""x, y in the world [m]."""


class Patrol:
    """Drive to ``goals`` in turn, starting with number ``first``, again and again.

    Goals that cannot be reached now are skipped. ``plan`` is the true raster of the walls; the robot detects moving
    objects with its lidar.
    """

    def __init__(
        self,
        plan: OccupancyGrid,
        goals: Sequence[Goal],
        first: int = 0,
        settings: BehaviourSettings = BehaviourSettings(),
    ) -> None:
        self._plan = plan
        self._reached = settings.navigation.arrived + settings.patrol.plan_cell  # a path ends at the centre of a cell
        self.goals = tuple(goals)
        self._places = [np.array(goal) for goal in goals]
        self._next = first % len(goals)
        self._here = np.zeros(2)
        self.finished = False

    def observe(self, scan: LidarScan, world_from_base: SE2) -> None:
        """Store the position of the robot."""
        self._here = np.array((world_from_base.x, world_from_base.y))

    def known_map(self) -> OccupancyGrid:
        """Return the floor plan."""
        return self._plan

    def choose_path(
        self, now: float, grid: OccupancyGrid, routes: Routes, banned: list[NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Return the path to the current goal, or to the next one once it is reached; (0, 2) if none is reachable."""
        if self._is_at(self._places[self._next]):
            self._next = (self._next + 1) % len(self._places)
        for step in range(len(self._places)):
            number = (self._next + step) % len(self._places)
            goal = self._places[number]
            cell = grid.frame.cells_from_metres(goal[None])[0]
            tried = any(math.dist(goal, place) < self._reached for place in banned)
            if not tried and not self._is_at(goal) and np.isfinite(routes.costs[tuple(cell)]):
                self._next = number
                return routes.path_to(cell)
        return NO_PATH

    def _is_at(self, goal: NDArray[np.float64]) -> bool:
        return math.dist(self._here, goal) < self._reached


def check_goals(world: World, goals: Sequence[Goal], starts: Sequence[SE2], radius: float, cell_size: float) -> None:
    """Raise ``ValueError`` with a goal that robots of ``radius`` [m] cannot reach from their starts, and why.

    ``cell_size`` [m] is that of the floor plan.
    """
    floor = find_floor(world, radius + cell_size, cell_size)
    reached = {int(floor.part[cell]) for cell in _cells(floor.part, floor.frame.cells_from_metres(_places(starts)))}
    for index, (x, y) in enumerate(goals):
        goal_text = f"goal {index} at ({x:g}, {y:g})"
        fault = world.fault_at(x, y)
        if fault is not None:
            raise ValueError(f"{goal_text} is {fault}")
        (cell,) = _cells(floor.part, floor.frame.cells_from_metres([(x, y)]))
        if floor.part[cell] == 0:
            raise ValueError(
                f"{goal_text} is {world.clearance([(x, y)])[0]:.2f} m from {world.bounds} of world {world.name!r}: too "
                f"narrow for a radius of {radius:g} m"
            )
        if reached - {0} and int(floor.part[cell]) not in reached:
            raise ValueError(f"{goal_text} is in a part of world {world.name!r} that no robot starts in")


def draw_goals(
    rng: np.random.Generator, world: World, start: SE2, radius: float, settings: PatrolSettings = PatrolSettings()
) -> tuple[Goal, ...]:
    """Draw goals uniformly from the floor that a robot of ``radius`` [m] can reach from its start.

    Raises ``ValueError`` if there is no such floor.
    """
    floor = find_floor(world, radius + 2.0 * settings.plan_cell, settings.plan_cell)
    (cell,) = _cells(floor.part, floor.frame.cells_from_metres(_places([start])))
    if floor.part[cell] == 0:
        nearest = ndimage.distance_transform_edt(floor.part == 0, return_distances=False, return_indices=True)
        cell = (int(nearest[0][cell]), int(nearest[1][cell]))
    members = np.argwhere(floor.part == floor.part[cell])
    if floor.part[cell] == 0 or len(members) == 0:
        raise ValueError(f"world {world.name!r} has no free floor for a patrol of a robot of {radius:g} m radius")
    drawn = members[rng.integers(len(members), size=settings.goal_count)]
    return tuple((float(x), float(y)) for x, y in floor.frame.metres_from_cells(drawn))


def _places(starts: Sequence[SE2]) -> NDArray[np.float64]:
    return np.array([(start.x, start.y) for start in starts])


def _cells(part: NDArray[np.int64], cells: NDArray[np.int64]) -> list[tuple[int, int]]:
    clipped = np.clip(cells, 0, np.array(part.shape) - 1)
    return [(int(row), int(col)) for row, col in clipped]
