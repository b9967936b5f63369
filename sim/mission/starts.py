"""Choose the poses at which robots start."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from skimage.graph import MCP_Geometric

from mapping.geometry.se2 import SE2
from sim.mission.settings import Starts
from sim.physics.robot import RobotSettings
from worlds.floor import CLEAR, Floor, find_floor
from worlds.world import World

CELL = 0.1
"""Cell size of the raster on which standing places are searched [m]."""

Chosen = list[SE2]
Draw = Callable[[int, Chosen], SE2 | None]
"""Return a start for the robot of an index, given the starts chosen before, None if there is no room."""


def is_apart(start: SE2, chosen: Chosen, clear: float) -> bool:
    """Return whether a start keeps a distance of twice ``clear`` [m] from all ``chosen`` ones."""
    return all(math.dist((start.x, start.y), (other.x, other.y)) >= 2.0 * clear for other in chosen)


class StandingPlaces:
    """List the cells where a robot of ``radius`` [m] can stand ``clear`` [m] from any solid.

    ``points`` (N, 2) [m] are in the world; ``cells`` (N, 2) and ``part`` (N,), the part of the floor, belong to them.
    """

    def __init__(self, world: World, radius: float, clear: float) -> None:
        self._world, self._clear = world, clear
        self.floor: Floor = find_floor(world, radius + CELL, CELL)
        standing = (self.floor.part > 0) & (self.floor.room >= clear)
        self.cells = np.argwhere(standing)
        self.points = self.floor.frame.metres_from_cells(self.cells)
        self.part = self.floor.part[standing]

    def first_clear(self, order: NDArray[np.int64], taken: Chosen) -> SE2 | None:
        """Return the first place, in this order, that is clear of walls and of the starts ``taken``."""
        for point in self.points[order]:
            place = SE2(float(point[0]), float(point[1]))
            if is_apart(place, taken, self._clear) and self._world.clearance(point[None])[0] >= self._clear:
                return place
        return None

    def path_lengths(self, sources: Chosen) -> NDArray[np.float64]:
        """Return the length of the way from the nearest source to each place [cells], +inf if there is none: (N,)."""
        search = MCP_Geometric(np.where(self.floor.part > 0, 1.0, -1.0))
        cells = self.floor.frame.cells_from_metres([(each.x, each.y) for each in sources])
        costs: NDArray[np.float64] = search.find_costs([tuple(cell) for cell in cells.tolist()])[0]
        return costs[tuple(self.cells.T)]

    def of_part(self, index: int) -> NDArray[np.int64]:
        """Return the indices of the places in the part of the floor for the robot of that index."""
        parts = max(1, min(self._world.parts, len(self.floor.areas)))
        return np.flatnonzero(self.part == index % parts + 1)


def _random(rng: np.random.Generator, places: StandingPlaces, gap: float) -> Draw:
    rank = np.empty(len(places.points), dtype=np.int64)
    rank[rng.permutation(len(rank))] = np.arange(len(rank))

    def draw(index: int, taken: Chosen) -> SE2 | None:
        members = places.of_part(index)
        return places.first_clear(members[np.argsort(rank[members])], taken)

    return draw


def _spread(rng: np.random.Generator, places: StandingPlaces, gap: float) -> Draw:
    """Place each robot as far as possible from the nearest one before it, the first as far as possible from
    anywhere."""
    anywhere = rng.random()

    def draw(index: int, taken: Chosen) -> SE2 | None:
        members = places.of_part(index)
        if len(members) == 0:
            return None
        others = np.array([(each.x, each.y) for each in taken]) if taken else places.points[members]
        others = others if taken else others[[int(anywhere * len(members))]]
        gaps = np.hypot(*(places.points[members][:, None] - others).transpose(2, 0, 1)).min(axis=1)
        return places.first_clear(members[np.argsort(-gaps, kind="stable")], taken)

    return draw


def _close(rng: np.random.Generator, places: StandingPlaces, gap: float) -> Draw:
    """Place the first robot anywhere, the others nearest to it by path length, and ``gap`` [m] from all others
    if there is room."""
    anywhere = rng.random()

    def draw(index: int, taken: Chosen) -> SE2 | None:
        members = places.of_part(0)
        if len(members) == 0:
            return None
        if not taken:
            return places.first_clear(np.roll(members, -int(anywhere * len(members))), taken)
        ways = places.path_lengths(taken[:1])
        near = np.flatnonzero(np.isfinite(ways))
        if gap:
            apart = places.path_lengths(taken)[near]
            near = near[apart >= min(gap / CELL, apart.max())]
        return places.first_clear(near[np.argsort(ways[near], kind="stable")], taken)

    return draw


DRAWS: dict[str, Callable[[np.random.Generator, StandingPlaces, float], Draw]] = {
    "random": _random,
    "spread": _spread,
    "close": _close,
}


def choose_starts(
    rng: np.random.Generator,
    world: World,
    robots: Sequence[RobotSettings],
    placement: Starts = "random",
    gap: float = 0.0,
) -> tuple[SE2, ...]:
    """Choose world_from_base for each robot that has no start of its own.

    Each chosen start lies on the largest floor that robots of this size can reach, at least 0.5 m (or the radius and
    0.1 m) from any solid and twice that from other robots, with a random heading. In a world of several parts, robots
    are distributed over the parts in turn; close starts are all in one part, and the way between any two is at least
    ``gap`` [m] long if there is room. Raises ``ValueError`` if a given start is
    in a wall or overlaps another one, or if there is no room for all robots.
    """
    check_starts(world, robots)
    radius = max(robot.radius for robot in robots)
    clear = max(CLEAR, radius + 0.1)
    draw = DRAWS[placement](rng, StandingPlaces(world, radius, clear), gap)
    headings = rng.uniform(-math.pi, math.pi, len(robots))
    given = [robot.start for robot in robots if robot.start is not None]
    taken: Chosen = list(given)
    own = [start for start in own_starts(world) if placement == "random" and is_apart(start, taken, clear)]
    starts: Chosen = []
    for index, robot in enumerate(robots):
        start = robot.start
        if start is None and own:
            start = own.pop(0)
            taken.append(start)
        elif start is None:
            place = draw(index, taken)
            if place is None:
                raise ValueError(f"robots is {len(robots)}, but world {world.name!r} has room for {len(taken)} only")
            start = SE2(place.x, place.y, float(headings[index]))
            taken.append(start)
        starts.append(start)
    return tuple(starts)


def random_starts(rng: np.random.Generator, world: World, robots: int, radius: float = 0.2) -> tuple[SE2, ...]:
    """Choose starts for ``robots`` equal robots of ``radius`` [m]: the world's own starts, then anywhere."""
    return choose_starts(rng, world, (RobotSettings(radius=radius),) * robots)


def check_starts(world: World, robots: Sequence[RobotSettings]) -> None:
    """Raise ``ValueError`` if a given start lies outside the world, in a wall, or on another robot's start."""
    given = [(index, robot, robot.start) for index, robot in enumerate(robots) if robot.start is not None]
    for index, robot, start in given:
        start_text = f"start {index} at ({start.x:g}, {start.y:g})"
        fault = world.fault_at(start.x, start.y)
        if fault is not None:
            raise ValueError(f"{start_text} is {fault}")
        gap = float(world.clearance([(start.x, start.y)])[0])
        if gap <= robot.radius:
            raise ValueError(
                f"{start_text} is {gap:.2f} m from {world.bounds} of world {world.name!r}, but the robot's radius is "
                f"{robot.radius:g} m"
            )
        for other_index, other, at in given[:index]:
            distance = math.dist((start.x, start.y), (at.x, at.y))
            if other_index < index and distance <= robot.radius + other.radius:
                raise ValueError(
                    f"{start_text} overlaps start {other_index} at ({at.x:g}, {at.y:g}): {distance:.2f} m apart, "
                    f"the robots need {robot.radius + other.radius:g} m"
                )


def own_starts(world: World) -> list[SE2]:
    """Return the world's own starts, without those less than 1 m from an earlier one, which are alternatives."""
    apart: list[SE2] = []
    for start in world.starts:
        if is_apart(start, apart, CLEAR):
            apart.append(start)
    return apart
