"""Plan the floor of an office building: rows of rooms along corridors, with walls and doors."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from worlds.polygon import Polygon, box

WALL = 0.15
"""Thickness of every wall [m]: three cells of a 5 cm map."""


@dataclass(frozen=True)
class Door:
    """Describe an opening of ``width`` [m] centred at (x, y), in a wall along x (``along_x``) or along y."""

    x: float
    y: float
    width: float
    along_x: bool


@dataclass(frozen=True)
class Room:
    """Describe a rectangle of free floor [m]. ``kind`` is room, cross or corridor; ``door_below`` is the side of its
    door."""

    x0: float
    y0: float
    x1: float
    y1: float
    kind: str
    door_below: bool = True

    @property
    def width(self) -> float:
        return self.x1 - self.x0

    @property
    def depth(self) -> float:
        return self.y1 - self.y0


@dataclass(frozen=True)
class FloorPlan:
    """Hold the rooms (with corridors), doors and wall polygons of a building of ``length`` x ``depth`` [m]."""

    length: float
    depth: float
    rooms: tuple[Room, ...]
    doors: tuple[Door, ...]
    walls: tuple[Polygon, ...]


def draw_floor_plan(rng: np.random.Generator, length: float, depth: float) -> FloorPlan:
    """Draw a floor plan with corridors along x, about one per ten metres of ``depth``; ``length`` and ``depth`` in
    metres.

    Room widths are multiples of one module, so many rooms are equal; equal rooms have their doors at the same place.
    Cross corridors connect the corridors. Raises ``ValueError`` below 10 x 8 m.
    """
    if not (length >= 10.0 and depth >= 8.0):
        raise ValueError(f"office: {length} x {depth} m is too small, needs 10 x 8 m")
    corridors = max(1, round(depth / 10.0))
    bands, halls = _split_depth(rng, depth, corridors, length)
    module = rng.uniform(3.3, 4.6)
    door_shares = {size: rng.uniform(0.1, 0.9) for size in (1, 2)}
    rooms = list(halls)
    doors: list[Door] = []
    walls = outer_walls(length, depth)
    for index, (y0, y1) in enumerate(bands):
        inner = 0 < index < corridors
        row = rooms_of_band(rng, length, y0, y1, module, inner, door_below=index > 0)
        row_doors = [corridor_door(rng, room, module, door_shares) for room in row if room.kind == "room"]
        if index > 0:
            walls += wall_along_x(length, y0 - WALL, row, [d for d in row_doors if d.y < y0])
        if index < corridors:
            walls += wall_along_x(length, y1, row, [d for d in row_doors if d.y > y1])
        links = _links(rng, row)
        walls += dividers(row, links)
        rooms += row
        doors += row_doors + links
    return FloorPlan(length, depth, tuple(rooms), tuple(doors), tuple(walls))


def _split_depth(
    rng: np.random.Generator, depth: float, corridors: int, length: float
) -> tuple[list[tuple[float, float]], list[Room]]:
    widths = rng.uniform(1.8, 2.4, corridors)
    shares = rng.uniform(0.75, 1.25, corridors + 1)
    free = depth - 2.0 * WALL - 2.0 * WALL * corridors - widths.sum()
    bands, halls, y = [], [], WALL
    for index, band in enumerate(shares / shares.sum() * free):
        bands.append((y, y + float(band)))
        y += float(band) + WALL
        if index < corridors:
            halls.append(Room(WALL, y, length - WALL, y + float(widths[index]), "corridor"))
            y += float(widths[index]) + WALL
    return bands, halls


def rooms_of_band(
    rng: np.random.Generator, length: float, y0: float, y1: float, module: float, inner: bool, door_below: bool
) -> list[Room]:
    """Divide a row from y0 to y1 [m] into rooms of one or two modules; an inner row gets a cross corridor."""
    widths: list[float] = []
    kinds: list[str] = []
    cross = rng.uniform(1.8, 2.4) if inner else 0.0
    remaining = length - WALL - (cross + WALL if inner else 0.0)
    while remaining > 1.6 * module:
        size = 2 if rng.random() < 0.2 and remaining > 3.0 * module else 1
        widths.append(size * module + (size - 1) * WALL)
        remaining -= widths[-1] + WALL
        kinds.append("room")
    widths.append(remaining - WALL)
    kinds.append("room")
    order = rng.permutation(len(widths))
    widths, kinds = [widths[k] for k in order], [kinds[k] for k in order]
    if inner:
        place = int(rng.integers(1, len(widths)))
        widths.insert(place, cross)
        kinds.insert(place, "cross")
    rooms, x = [], WALL
    for width, kind in zip(widths, kinds, strict=True):
        below = bool(rng.random() < 0.5) if inner else door_below
        rooms.append(Room(x, y0, x + width, y1, kind, below))
        x += width + WALL
    return rooms


def corridor_door(rng: np.random.Generator, room: Room, module: float, shares: dict[int, float]) -> Door:
    """Draw a room's door to its corridor: at the position of equal rooms with probability 0.7, else at random."""
    share = shares[2 if room.width > 1.5 * module else 1] if rng.random() < 0.7 else rng.uniform(0.1, 0.9)
    width = rng.uniform(0.95, 1.2)
    margin = 0.25 + width / 2.0
    x = room.x0 + margin + share * (room.width - 2.0 * margin)
    return Door(x, room.y0 - WALL / 2.0 if room.door_below else room.y1 + WALL / 2.0, width, along_x=True)


def _links(rng: np.random.Generator, row: list[Room]) -> list[Door]:
    """Draw doors between some neighbouring rooms."""
    links = []
    for left, right in pairwise(row):
        if left.kind == right.kind == "room" and rng.random() < 0.15:
            y = left.y0 + rng.uniform(0.35, 0.65) * left.depth
            links.append(Door(left.x1 + WALL / 2.0, y, rng.uniform(0.95, 1.2), along_x=False))
    return links


def outer_walls(length: float, depth: float) -> list[Polygon]:
    """Return the four outer walls of a building of ``length`` x ``depth`` [m]."""
    return [
        box(0.0, 0.0, length, WALL),
        box(0.0, depth - WALL, length, depth),
        box(0.0, 0.0, WALL, depth),
        box(length - WALL, 0.0, length, depth),
    ]


def wall_along_x(length: float, y: float, row: list[Room], doors: list[Door]) -> list[Polygon]:
    """Return the wall between a row and a corridor, open at doors and cross corridors."""
    gaps = [(door.x - door.width / 2.0, door.x + door.width / 2.0) for door in doors]
    gaps += [(room.x0, room.x1) for room in row if room.kind == "cross"]
    return [box(a, y, b, y + WALL) for a, b in between(0.0, length, gaps)]


def dividers(row: list[Room], links: list[Door]) -> list[Polygon]:
    """Return the walls along y between the rooms of a row, open at the links."""
    walls = []
    for room in row[:-1]:
        gaps = [(d.y - d.width / 2.0, d.y + d.width / 2.0) for d in links if abs(d.x - room.x1) < WALL]
        walls += [box(room.x1, a, room.x1 + WALL, b) for a, b in between(room.y0 - WALL, room.y1 + WALL, gaps)]
    return walls


def between(start: float, end: float, gaps: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the intervals from start to end that the gaps leave."""
    borders = [start, *(border for gap in sorted(gaps) for border in gap), end]
    return [(a, b) for a, b in zip(borders[::2], borders[1::2], strict=True) if b > a]
