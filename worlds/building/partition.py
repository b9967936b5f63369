"""Divide a rectangle into rooms recursively, and connect them all by doors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from worlds.building.floor_plan import WALL, Door, FloorPlan, Room, between, outer_walls
from worlds.polygon import Polygon, box

CORNER = 0.25
"""Least distance from a door to the corner of a room [m]."""


@dataclass(frozen=True)
class _Cut:
    """Describe a wall from ``low`` to ``high`` [m], along x (``along_x``) or y, whose lower face is at ``at`` [m]."""

    along_x: bool
    at: float
    low: float
    high: float


def partition(
    rng: np.random.Generator, length: float, depth: float, least: float = 2.5, largest: float = 26.0
) -> FloorPlan:
    """Divide a floor of ``length`` x ``depth`` [m] into rooms at least ``least`` [m] wide and at most about ``largest``
    [m^2].

    All rooms are connected; about one in four other pairs of neighbours also has a door.
    """
    cuts: list[_Cut] = []
    rooms = _halved(rng, Room(WALL, WALL, length - WALL, depth - WALL, "room"), least, largest, cuts)
    doors = _doors(rng, rooms)
    walls = outer_walls(length, depth) + [piece for cut in cuts for piece in _wall(cut, doors)]
    return FloorPlan(length, depth, tuple(rooms), tuple(doors), tuple(walls))


def _halved(rng: np.random.Generator, room: Room, least: float, largest: float, cuts: list[_Cut]) -> list[Room]:
    across = room.width >= room.depth
    long = max(room.width, room.depth)
    enough = rng.uniform(0.45, 1.0) * largest
    if long < 2.0 * least + WALL or (room.width * room.depth < enough and long < 2.2 * min(room.width, room.depth)):
        return [room]
    share = rng.uniform(0.35, 0.65)
    first = float(np.clip(share * long, least, long - least - WALL))
    if across:
        at = room.x0 + first
        cuts.append(_Cut(False, at, room.y0, room.y1))
        halves = (Room(room.x0, room.y0, at, room.y1, "room"), Room(at + WALL, room.y0, room.x1, room.y1, "room"))
    else:
        at = room.y0 + first
        cuts.append(_Cut(True, at, room.x0, room.x1))
        halves = (Room(room.x0, room.y0, room.x1, at, "room"), Room(room.x0, at + WALL, room.x1, room.y1, "room"))
    return [part for half in halves for part in _halved(rng, half, least, largest, cuts)]


def _doors(rng: np.random.Generator, rooms: list[Room]) -> list[Door]:
    """Add doors until all rooms are connected, larger rooms first, because halls have more doors than small rooms."""
    pairs = [(a, b) for a in range(len(rooms)) for b in range(len(rooms)) if _shared(rooms[a], rooms[b])]
    sizes = [room.width * room.depth for room in rooms]
    pairs.sort(key=lambda pair: -max(sizes[pair[0]], sizes[pair[1]]))
    group = list(range(len(rooms)))
    doors = []
    for a, b in pairs:
        joins = group[a] != group[b]
        if joins or rng.random() < 0.25:
            doors.append(_door(rng, rooms[a], rooms[b]))
            group = [group[a] if each == group[b] else each for each in group]
    return doors


def _shared(first: Room, second: Room) -> tuple[float, float] | None:
    """Return the interval of wall that a room shares with one right of it or above it, None if a door does not fit."""
    if abs(first.x1 + WALL - second.x0) < 1e-6:
        low, high = max(first.y0, second.y0), min(first.y1, second.y1)
    elif abs(first.y1 + WALL - second.y0) < 1e-6:
        low, high = max(first.x0, second.x0), min(first.x1, second.x1)
    else:
        return None
    return (low, high) if high - low >= 1.2 + 2.0 * CORNER else None


def _door(rng: np.random.Generator, first: Room, second: Room) -> Door:
    low, high = _shared(first, second) or (0.0, 0.0)
    width = rng.uniform(0.92, 1.1)
    if min(first.width * first.depth, second.width * second.depth) > 14.0:
        width = min(rng.uniform(1.2, 2.4), high - low - 2.0 * CORNER)
    margin = CORNER + width / 2.0
    along = low + margin + rng.random() * (high - low - 2.0 * margin)
    if abs(first.x1 + WALL - second.x0) < 1e-6:
        return Door(first.x1 + WALL / 2.0, along, width, along_x=False)
    return Door(along, first.y1 + WALL / 2.0, width, along_x=True)


def _wall(cut: _Cut, doors: list[Door]) -> list[Polygon]:
    on_it = [
        (door.x if cut.along_x else door.y, door.width / 2.0)
        for door in doors
        if door.along_x == cut.along_x
        and abs((door.y if cut.along_x else door.x) - cut.at - WALL / 2.0) < 1e-6
        and cut.low < (door.x if cut.along_x else door.y) < cut.high
    ]
    gaps = [(middle - half, middle + half) for middle, half in on_it]
    reach = between(cut.low - WALL / 2.0, cut.high + WALL / 2.0, gaps)
    if cut.along_x:
        return [box(a, cut.at, b, cut.at + WALL) for a, b in reach]
    return [box(cut.at, a, cut.at + WALL, b) for a, b in reach]
