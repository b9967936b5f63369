"""Where robots begin."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.se2 import SE2
from worlds.floor import CLEAR, find_floor
from worlds.world import World

CELL = 0.1
"""Raster on which standing places are looked for [m]."""


def random_starts(rng: np.random.Generator, world: World, robots: int, radius: float = 0.2) -> tuple[SE2, ...]:
    """Choose world_from_base for that many robots of ``radius`` [m]: the starts that the world brings, as far as they
    are 1 m apart, and then places drawn anywhere on the largest floor they can drive.

    Each drawn one stands with its centre at least 0.5 m from any solid and 1 m from the others, in any heading. In a
    world of several parts the robots go to one after the other. Raises ``ValueError`` where the floor does not hold
    that many.
    """
    places, parts = _standing_places(world, radius)
    order = rng.permutation(len(places))
    headings = rng.uniform(-math.pi, math.pi, robots)
    waiting = [iter(places[order[parts[order] == part + 1]]) for part in range(world.parts)]
    chosen = own_starts(world)[:robots]
    while len(chosen) < robots:
        place = next((p for p in waiting[len(chosen) % world.parts] if _is_clear(p, world, chosen)), None)
        if place is None:
            room = f"has clear standing room for {len(chosen)} only"
            raise ValueError(f"robots is {robots}, but world {world.name!r} {room}")
        chosen.append(SE2(float(place[0]), float(place[1]), float(headings[len(chosen)])))
    return tuple(chosen)


def own_starts(world: World) -> list[SE2]:
    """The starts that the world brings, without those less than 1 m from one before: they are alternatives."""
    apart: list[SE2] = []
    for start in world.starts:
        if all(math.dist((start.x, start.y), (other.x, other.y)) >= 2.0 * CLEAR for other in apart):
            apart.append(start)
    return apart


def _is_clear(place: NDArray[np.float64], world: World, chosen: list[SE2]) -> bool:
    apart = all(math.dist(place, (other.x, other.y)) >= 2.0 * CLEAR for other in chosen)
    return apart and bool(world.clearance(place[None])[0] >= CLEAR)


def _standing_places(world: World, radius: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points [m], (N, 2), on the floor and 0.5 m clear as far as a raster can tell, and the part of each, (N,)."""
    floor = find_floor(world, radius + CELL, CELL)
    standing = (floor.part > 0) & (floor.room >= CLEAR)
    return floor.frame.metres_from_cells(np.argwhere(standing)), floor.part[standing]
