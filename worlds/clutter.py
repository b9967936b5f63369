"""What stands in the rooms: desks, tables, cabinets, shelves and pillars that never close a door."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from worlds.floor_plan import Door, FloorPlan, Room
from worlds.polygon import Polygon, box, contains, disc, distances, edges, turned_box

PASSAGE = 0.65
"""Between any two things that do not touch there is at least this much room [m]."""
DOOR_FREE = 0.75
"""Nothing stands nearer than this to the edge of a door [m]."""
SUNK = 0.01
"""Furniture against a wall reaches this far into it [m], so that no ray finds a gap."""


@dataclass(frozen=True)
class Fitting:
    """A piece of furniture against a room's wall: ``at`` its share along that wall, ``long`` and ``deep`` in metres."""

    wall: str
    at: float
    long: float
    deep: float


def furnish(rng: np.random.Generator, plan: FloorPlan) -> tuple[Polygon, ...]:
    """Draw furniture for each room of the plan: like rooms get the same fittings, and something of their own."""
    alike = tuple(_fittings(rng) for _ in range(2))
    in_rooms: list[Polygon] = []
    in_halls: list[Polygon] = []
    for room in plan.rooms:
        if room.kind == "room":
            in_rooms += _admitted(_room_pieces(rng, room, alike[int(rng.random() < 0.3)]), room, plan, [])
        else:
            in_halls += _admitted(_corridor_pieces(rng, room), room, plan, in_halls)
    return (*in_halls, *in_rooms)


def _fittings(rng: np.random.Generator) -> tuple[Fitting, ...]:
    """What a row of like offices has in each of them, told from the door: far wall, left and right."""
    desk = Fitting("far", rng.uniform(0.1, 0.9), rng.uniform(1.4, 1.8), rng.uniform(0.7, 0.9))
    cabinet = Fitting(str(rng.choice(["left", "right"])), rng.uniform(0.2, 0.9), rng.uniform(0.8, 1.4), 0.45)
    shelf = Fitting(str(rng.choice(["left", "right"])), rng.uniform(0.3, 0.9), rng.uniform(1.0, 2.0), 0.3)
    return desk, cabinet, shelf


def _room_pieces(rng: np.random.Generator, room: Room, fittings: tuple[Fitting, ...]) -> list[Polygon]:
    pieces = [_placed(fitting, room) for fitting in fittings if rng.random() < 0.85]
    if room.width > 6.0 or rng.random() < 0.25:
        yaw = rng.choice([0.0, np.pi / 2.0]) + rng.normal(0.0, 0.1)
        x, y = _somewhere(rng, room, 0.3)
        pieces.append(turned_box(x, y, rng.uniform(1.4, 2.4), rng.uniform(0.8, 1.2), yaw))
    for _ in range(int(rng.integers(1, 4))):
        x, y = _somewhere(rng, room, 0.1)
        kind = rng.random()
        if kind < 0.3:
            pieces.append(disc(x, y, rng.uniform(0.15, 0.3), corners=12))
        elif kind < 0.6:
            pieces.append(turned_box(x, y, rng.uniform(0.4, 0.9), rng.uniform(0.4, 0.6), rng.uniform(0.0, np.pi)))
        else:
            wall = str(rng.choice(["far", "left", "right"]))
            size = rng.uniform((0.4, 0.3), (1.5, 0.6))
            pieces.append(_placed(Fitting(wall, rng.random(), float(size[0]), float(size[1])), room))
    return pieces


def _corridor_pieces(rng: np.random.Generator, hall: Room) -> list[Polygon]:
    """Cabinets and machines along the sides of a corridor or cross corridor, about one every six metres."""
    along_x = hall.kind == "corridor"
    count = int(max(hall.width, hall.depth) / 6.0) + 1
    pieces = []
    for _ in range(count):
        long, deep, at, first_side = rng.uniform(0.4, 1.4), rng.uniform(0.25, 0.4), rng.random(), rng.random() < 0.5
        if along_x:
            x = hall.x0 + at * (hall.width - long)
            y = hall.y0 - SUNK if first_side else hall.y1 + SUNK - deep
            pieces.append(box(x, y, x + long, y + deep))
        else:
            x = hall.x0 - SUNK if first_side else hall.x1 + SUNK - deep
            y = hall.y0 + at * (hall.depth - long)
            pieces.append(box(x, y, x + deep, y + long))
    return pieces


def _somewhere(rng: np.random.Generator, room: Room, margin: float) -> tuple[float, float]:
    share = rng.uniform(margin, 1.0 - margin, 2)
    return room.x0 + float(share[0]) * room.width, room.y0 + float(share[1]) * room.depth


def _placed(fitting: Fitting, room: Room) -> Polygon:
    if fitting.wall == "far":
        x = room.x0 + fitting.at * (room.width - fitting.long)
        y = room.y1 + SUNK - fitting.deep if room.door_below else room.y0 - SUNK
        return box(x, y, x + fitting.long, y + fitting.deep)
    share = fitting.at if room.door_below else 1.0 - fitting.at
    y = room.y0 + share * (room.depth - fitting.long)
    x = room.x0 - SUNK if fitting.wall == "left" else room.x1 + SUNK - fitting.deep
    return box(x, y, x + fitting.deep, y + fitting.long)


def _admitted(wanted: Iterable[Polygon], room: Room, plan: FloorPlan, standing: list[Polygon]) -> list[Polygon]:
    """The wanted pieces that fit: clear of doors, no slits between things, and the floor stays in one piece."""
    walls = [wall for wall in plan.walls if _is_near(wall, room)]
    doors = [door for door in plan.doors if _is_near(np.array([(door.x, door.y)]), room)]
    points = _floor_points(room)
    floor = np.logical_and.reduce([_leaves_free(wall, points) for wall in walls])
    kept: list[Polygon] = []
    for piece in wanted:
        from_walls = [_gap(piece, wall) for wall in walls]
        from_pieces = [_gap(piece, other) for other in (*standing, *kept)]
        if min(from_pieces, default=PASSAGE) < PASSAGE or any(0.0 < gap < PASSAGE for gap in from_walls):
            continue
        left = floor & _leaves_free(piece, points)
        if _keeps_doors(piece, doors) and _is_one_piece(left):
            kept.append(piece)
            floor = left
    return kept


def _is_near(points: Polygon, room: Room) -> bool:
    low, high = points.min(axis=0), points.max(axis=0)
    return bool(
        low[0] < room.x1 + 1.0 and high[0] > room.x0 - 1.0 and low[1] < room.y1 + 1.0 and high[1] > room.y0 - 1.0
    )


def _gap(one: Polygon, other: Polygon) -> float:
    """Between two convex polygons [m], 0 where a corner of one lies in the other; a lower bound where far apart."""
    beside = max((other.min(axis=0) - one.max(axis=0)).max(), (one.min(axis=0) - other.max(axis=0)).max())
    if beside >= PASSAGE:
        return float(beside)
    if contains(other, one).any() or contains(one, other).any():
        return 0.0
    return float(min(distances(edges(one), other).min(), distances(edges(other), one).min()))


def _keeps_doors(piece: Polygon, doors: list[Door]) -> bool:
    centres = np.array([(door.x, door.y) for door in doors]).reshape(-1, 2)
    reach = np.array([door.width / 2.0 + DOOR_FREE for door in doors])
    return not doors or bool((distances(edges(piece), centres) >= reach).all())


def _floor_points(room: Room, step: float = 0.1) -> NDArray[np.float64]:
    """Points [m] on the floor of the room, (rows, cols, 2)."""
    x, y = np.arange(room.x0, room.x1, step), np.arange(room.y0, room.y1, step)
    return np.stack(np.meshgrid(x, y), axis=-1)


def _leaves_free(solid: Polygon, points: NDArray[np.float64], radius: float = 0.25) -> NDArray[np.bool_]:
    """At which of the points, (rows, cols, 2), a robot of that radius [m] stands clear of the solid."""
    free = np.ones(points.shape[:2], dtype=np.bool_)
    low, high = solid.min(axis=0) - radius, solid.max(axis=0) + radius
    near = ((points >= low) & (points <= high)).all(axis=2)
    free[near] = (distances(edges(solid), points[near]) >= radius) & ~contains(solid, points[near])
    return free


def _is_one_piece(floor: NDArray[np.bool_]) -> bool:
    return bool(ndimage.label(floor, structure=np.ones((3, 3)))[1] == 1)
