"""Ways of choosing where robots begin."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from skimage.graph import MCP_Geometric

from mapping.geometry.se2 import SE2
from worlds.floor import Floor, find_floor
from worlds.world import World

CELL = 0.1
"""Raster on which standing places are looked for [m]."""

Chosen = list[SE2]
Draw = Callable[[int, Chosen], SE2 | None]
"""A start for the robot of that number beside those chosen, if there is one."""


def is_apart(start: SE2, chosen: Chosen, clear: float) -> bool:
    """Whether a start keeps twice ``clear`` [m] from all chosen before."""
    return all(math.dist((start.x, start.y), (other.x, other.y)) >= 2.0 * clear for other in chosen)


class StandingPlaces:
    """Where robots of ``radius`` [m] can stand ``clear`` [m] of anything, as far as a raster can tell: ``points`` [m],
    (N, 2), in the world, their ``cells``, and the ``part`` of the floor that each lies in, (N,)."""

    def __init__(self, world: World, radius: float, clear: float) -> None:
        self._world, self._clear = world, clear
        self.floor: Floor = find_floor(world, radius + CELL, CELL)
        standing = (self.floor.part > 0) & (self.floor.room >= clear)
        self.cells = np.argwhere(standing)
        self.points = self.floor.frame.metres_from_cells(self.cells)
        self.part = self.floor.part[standing]

    def first_clear(self, order: NDArray[np.int64], taken: Chosen) -> SE2 | None:
        """The first of the places, by number, that is clear of walls and of the robots there."""
        for point in self.points[order]:
            place = SE2(float(point[0]), float(point[1]))
            if is_apart(place, taken, self._clear) and self._world.clearance(point[None])[0] >= self._clear:
                return place
        return None

    def of_part(self, index: int) -> NDArray[np.int64]:
        """The numbers of the places in the part that the robot of that index goes to."""
        parts = max(1, min(self._world.parts, len(self.floor.areas)))
        return np.flatnonzero(self.part == index % parts + 1)


def _random(rng: np.random.Generator, places: StandingPlaces) -> Draw:
    rank = np.empty(len(places.points), dtype=np.int64)
    rank[rng.permutation(len(rank))] = np.arange(len(rank))

    def draw(index: int, taken: Chosen) -> SE2 | None:
        members = places.of_part(index)
        return places.first_clear(members[np.argsort(rank[members])], taken)

    return draw


def _spread(rng: np.random.Generator, places: StandingPlaces) -> Draw:
    """Each as far from the nearest of those before as it can be; the first as far as it can be from anywhere."""
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


def _close(rng: np.random.Generator, places: StandingPlaces) -> Draw:
    """The first anywhere, the others the nearest to it by the way that a robot would drive."""
    anywhere = rng.random()

    def draw(index: int, taken: Chosen) -> SE2 | None:
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


DRAWS: dict[str, Callable[[np.random.Generator, StandingPlaces], Draw]] = {
    "random": _random,
    "spread": _spread,
    "close": _close,
}
