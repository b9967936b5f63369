"""Generate the U-shaped office floor of Chen (2021), as far as it is described."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.se2 import SE2
from worlds.building.drawing import WorldDrawing, require_size
from worlds.building.floor_plan import WALL, Door, FloorPlan, Room, between, dividers, outer_walls
from worlds.building.furniture import somewhere_against
from worlds.building.furniture_placement import Group, place_furniture
from worlds.polygon import Polygon, box

BREADTH, LENGTH = 6.85, 5.75
"""Approximate length of a room along its corridor [m], in the lower wing and in the other two."""
STUB = 0.9
"""Length of the short walls in the rooms [m]."""


def thesis_floor(rng: np.random.Generator, width: float = 49.0, height: float = 37.0) -> WorldDrawing:
    """Draw three wings around a solid courtyard, open at the top: a corridor 1.8 to 2 m wide and a row of rooms of 5.5
    to 7.5 m outside of it, most of them equal, with short walls inside.

    It has three starts, in the left, the right and the lower corridor, so that the first two robots meet last. Raises
    ``ValueError`` below 36 x 26 m.
    """
    require_size("thesis_floor", width, height, (36.0, 26.0))
    plan = thesis_floor_plan(rng, width, height)
    furniture = [piece for room in plan.rooms[3:] for piece in place_furniture(_furniture(rng, room), room, plan)]
    lower, left, right = plan.rooms[:3]
    starts = (
        SE2((left.x0 + left.x1) / 2.0, 0.72 * height, math.pi / 2.0),
        SE2((right.x0 + right.x1) / 2.0, 0.72 * height, math.pi / 2.0),
        SE2(width / 2.0, (lower.y0 + lower.y1) / 2.0, 0.0),
    )
    return WorldDrawing((*plan.walls, *furniture), starts)


def thesis_floor_plan(rng: np.random.Generator, width: float, height: float) -> FloorPlan:
    """Draw the floor without furniture. Its first rooms are the lower, the left and the right corridor."""
    deep, way = rng.uniform(5.6, 6.2), rng.uniform(1.8, 2.0)
    y0, x0 = WALL + deep + WALL, WALL + deep + WALL
    corridors = [
        Room(WALL, y0, width - WALL, y0 + way, "corridor"),
        Room(x0, y0, x0 + way, height - WALL, "corridor"),
        Room(width - x0 - way, y0, width - x0, height - WALL, "corridor"),
    ]
    low = [Room(a, WALL, b, WALL + deep, "room", False) for a, b in _stretches(rng, WALL, width - WALL, BREADTH)]
    up = _stretches(rng, y0 + way + WALL, height - WALL, LENGTH)
    left = [Room(WALL, a, WALL + deep, b, "room") for a, b in up]
    right = [Room(width - WALL - deep, a, width - WALL, b, "room") for a, b in up]
    share = rng.uniform(0.15, 0.85)
    low_doors = [Door(_at(rng, r.x0, r.x1, share), y0 - WALL / 2.0, rng.uniform(0.95, 1.1), True) for r in low]
    left_doors = [Door(x0 - WALL / 2.0, _at(rng, r.y0, r.y1, share), rng.uniform(0.95, 1.1), False) for r in left]
    right_doors = [
        Door(width - x0 + WALL / 2.0, _at(rng, r.y0, r.y1, share), rng.uniform(0.95, 1.1), False) for r in right
    ]
    bottom = y0 + way
    walls = [*outer_walls(width, height), box(x0 + way, bottom, width - x0 - way, height)]
    walls += [box(a, y0 - WALL, b, y0) for a, b in between(0.0, width, _gaps(low_doors))]
    for x, doors in ((x0 - WALL, left_doors), (width - x0, right_doors)):
        walls += [box(x, a, x + WALL, b) for a, b in between(bottom, height, _gaps(doors))]
    walls += dividers(low, [])
    for row in (left, right):
        walls += [box(r.x0 - WALL / 2.0, r.y0 - WALL, r.x1 + WALL / 2.0, r.y0) for r in row]
    rooms = (*corridors, *low, *left, *right)
    return FloorPlan(
        width, height, rooms, (*low_doors, *left_doors, *right_doors), (*walls, *_stubs(rng, low, left, right))
    )


def _stretches(rng: np.random.Generator, start: float, end: float, length: float) -> list[tuple[float, float]]:
    """Divide start to end [m] into equal rooms, except two neighbours whose common wall is moved."""
    count = round((end - start) / length)
    each = (end - start - (count - 1) * WALL) / count
    firsts = start + (each + WALL) * np.arange(count)
    firsts[int(rng.integers(1, count))] += rng.uniform(-0.5, 0.5)
    return [(float(a), float(b)) for a, b in zip(firsts, [*(firsts[1:] - WALL), end], strict=True)]


def _at(rng: np.random.Generator, start: float, end: float, share: float) -> float:
    margin = 0.8
    return start + margin + (share if rng.random() < 0.75 else rng.random()) * (end - start - 2.0 * margin)


def _gaps(doors: list[Door]) -> list[tuple[float, float]]:
    middles = [(door.x if door.along_x else door.y, door.width / 2.0) for door in doors]
    return [(middle - half, middle + half) for middle, half in middles]


def _stubs(rng: np.random.Generator, low: list[Room], left: list[Room], right: list[Room]) -> list[Polygon]:
    """Draw short walls that stand out from the walls between rooms, all at one depth."""
    share, deep = rng.uniform(0.35, 0.55), low[0].depth
    pieces = [box(r.x0 - WALL / 2.0, WALL + share * deep, r.x0 + STUB, 2.0 * WALL + share * deep) for r in low[1:]]
    for row, x in ((left, WALL + share * deep), (right, right[0].x1 - share * deep)):
        pieces += [box(x - WALL / 2.0, r.y0 - WALL / 2.0, x + WALL / 2.0, r.y0 + STUB) for r in row]
    return pieces


def _furniture(rng: np.random.Generator, room: Room) -> list[list[Group]]:
    """Draw a desk, a cabinet and a shelf, against any wall."""
    return [
        somewhere_against(rng, room, rng.uniform(1.4, 1.8), 0.8),
        somewhere_against(rng, room, rng.uniform(0.8, 1.4), 0.45),
        somewhere_against(rng, room, rng.uniform(1.0, 2.0), 0.3),
    ]
