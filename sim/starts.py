"""Where robots begin."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from skimage.graph import MCP_Geometric

from mapping.se2 import SE2
from sim.robot import RobotSettings
from worlds.floor import CLEAR, Floor, find_floor
from worlds.world import World

Starts = Literal["random", "spread", "close"]
"""random: the world's own, then anywhere; spread: as far apart as possible; close: as near one another as they fit."""

STARTS: tuple[str, ...] = get_args(Starts)

CELL = 0.1
"""Raster on which standing places are looked for [m]."""

_Chosen = list[SE2]
_Draw = Callable[[int, _Chosen], SE2 | None]
"""A start for the robot of that number beside those chosen, if there is one."""


def choose_starts(
    rng: np.random.Generator, world: World, robots: Sequence[RobotSettings], how: Starts = "random"
) -> tuple[SE2, ...]:
    """world_from_base for each robot: its own start if it has one, else one that is chosen on the largest floor that
    robots of this size can drive.

    Each chosen one stands with its centre at least 0.5 m (or its radius and 0.1 m) from any solid and twice that from
    the others, in any heading. In a world of several parts the robots go to one after the other, but all to one part
    where they begin close. Raises ``ValueError`` where a given start is in a wall or overlaps another robot's, and
    where the floor does not hold that many.
    """
    check_starts(world, robots)
    radius = max(robot.radius for robot in robots)
    clear = max(CLEAR, radius + 0.1)
    draw = _DRAWS[how](rng, _Places(world, radius, clear))
    headings = rng.uniform(-math.pi, math.pi, len(robots))
    given = [robot.start for robot in robots if robot.start is not None]
    taken: _Chosen = list(given)
    own = [start for start in own_starts(world) if how == "random" and _is_apart(start, taken, clear)]
    starts: _Chosen = []
    for index, robot in enumerate(robots):
        start = robot.start
        if start is None and own:
            start = own.pop(0)
            taken.append(start)
        elif start is None:
            place = draw(index, taken)
            if place is None:
                raise ValueError(
                    f"robots is {len(robots)}, but world {world.name!r} has clear standing room for {len(taken)} only"
                )
            start = SE2(place.x, place.y, float(headings[index]))
            taken.append(start)
        starts.append(start)
    return tuple(starts)


def random_starts(rng: np.random.Generator, world: World, robots: int, radius: float = 0.2) -> tuple[SE2, ...]:
    """:func:`choose_starts` for as many equal robots of ``radius`` [m]: the world's own starts, then anywhere."""
    return choose_starts(rng, world, (RobotSettings(radius=radius),) * robots)


def check_starts(world: World, robots: Sequence[RobotSettings]) -> None:
    """Raise ``ValueError`` where a given start lies outside the world, in a wall, or on another robot's."""
    given = [(index, robot, robot.start) for index, robot in enumerate(robots) if robot.start is not None]
    for index, robot, start in given:
        told = f"start {index} at ({start.x:g}, {start.y:g})"
        fault = world.fault_at(start.x, start.y)
        if fault is not None:
            raise ValueError(f"{told} is {fault}")
        gap = float(world.clearance([(start.x, start.y)])[0])
        if gap <= robot.radius:
            raise ValueError(
                f"{told} is {gap:.2f} m from {world.bounds} of world {world.name!r}, but the robot's radius is "
                f"{robot.radius:g} m"
            )
        for other_index, other, at in given[:index]:
            distance = math.dist((start.x, start.y), (at.x, at.y))
            if other_index < index and distance <= robot.radius + other.radius:
                raise ValueError(
                    f"{told} overlaps start {other_index} at ({at.x:g}, {at.y:g}): {distance:.2f} m apart, the robots "
                    f"need {robot.radius + other.radius:g} m"
                )


def own_starts(world: World) -> list[SE2]:
    """The starts that the world brings, without those less than 1 m from one before: they are alternatives."""
    apart: list[SE2] = []
    for start in world.starts:
        if _is_apart(start, apart, CLEAR):
            apart.append(start)
    return apart


def _is_apart(start: SE2, chosen: _Chosen, clear: float) -> bool:
    return all(math.dist((start.x, start.y), (other.x, other.y)) >= 2.0 * clear for other in chosen)


class _Places:
    """Points [m], (N, 2), on the floor and clear as far as a raster can tell, and the part of each, (N,)."""

    def __init__(self, world: World, radius: float, clear: float) -> None:
        self._world, self._clear = world, clear
        self.floor: Floor = find_floor(world, radius + CELL, CELL)
        standing = (self.floor.part > 0) & (self.floor.room >= clear)
        self.cells = np.argwhere(standing)
        self.points = self.floor.frame.metres_from_cells(self.cells)
        self.part = self.floor.part[standing]

    def first_clear(self, order: NDArray[np.int64], taken: _Chosen) -> SE2 | None:
        """The first of the places, by number, that is clear of walls and of the robots there."""
        for point in self.points[order]:
            place = SE2(float(point[0]), float(point[1]))
            if _is_apart(place, taken, self._clear) and self._world.clearance(point[None])[0] >= self._clear:
                return place
        return None

    def of_part(self, index: int) -> NDArray[np.int64]:
        """The numbers of the places in the part that the robot of that index goes to."""
        parts = max(1, min(self._world.parts, len(self.floor.areas)))
        return np.flatnonzero(self.part == index % parts + 1)


def _random(rng: np.random.Generator, places: _Places) -> _Draw:
    rank = np.empty(len(places.points), dtype=np.int64)
    rank[rng.permutation(len(rank))] = np.arange(len(rank))

    def draw(index: int, taken: _Chosen) -> SE2 | None:
        members = places.of_part(index)
        return places.first_clear(members[np.argsort(rank[members])], taken)

    return draw


def _spread(rng: np.random.Generator, places: _Places) -> _Draw:
    """Each as far from the nearest of those before as it can be; the first as far as it can be from anywhere."""
    anywhere = rng.random()

    def draw(index: int, taken: _Chosen) -> SE2 | None:
        members = places.of_part(index)
        if len(members) == 0:
            return None
        others = np.array([(each.x, each.y) for each in taken]) if taken else places.points[members]
        others = others if taken else others[[int(anywhere * len(members))]]
        gaps = np.hypot(*(places.points[members][:, None] - others).transpose(2, 0, 1)).min(axis=1)
        return places.first_clear(members[np.argsort(-gaps, kind="stable")], taken)

    return draw


def _close(rng: np.random.Generator, places: _Places) -> _Draw:
    """The first anywhere, the others the nearest to it by the way that a robot would drive."""
    anywhere = rng.random()

    def draw(index: int, taken: _Chosen) -> SE2 | None:
        members = places.of_part(0)
        if len(members) == 0:
            return None
        if not taken:
            return places.first_clear(np.roll(members, -int(anywhere * len(members))), taken)
        heart = places.floor.frame.cells_from_metres([(taken[0].x, taken[0].y)])[0]
        search = MCP_Geometric(np.where(places.floor.part > 0, 1.0, -1.0))
        ways = search.find_costs([tuple(heart.tolist())])[0][tuple(places.cells.T)]
        near = np.flatnonzero(np.isfinite(ways))
        return places.first_clear(near[np.argsort(ways[near], kind="stable")], taken)

    return draw


_DRAWS: dict[Starts, Callable[[np.random.Generator, _Places], _Draw]] = {
    "random": _random,
    "spread": _spread,
    "close": _close,
}
