"""Furnish an office: desks, tables, cabinets, shelves and pillars."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from worlds.building.floor_plan import FloorPlan, Room
from worlds.building.furniture_placement import place_furniture
from worlds.polygon import Polygon, box, disc, turned_box

SUNK = 0.01
"""Depth [m] by which furniture overlaps its wall, so that no ray passes between them."""


@dataclass(frozen=True)
class Fitting:
    """Describe a piece of furniture against a wall: ``at`` is its relative position along the wall, ``long`` and
    ``deep`` are in metres."""

    wall: str
    at: float
    long: float
    deep: float


def furnish(rng: np.random.Generator, plan: FloorPlan) -> tuple[Polygon, ...]:
    """Draw furniture for each room of the plan. Most rooms get the same fittings; each also gets some of its own."""
    alike = tuple(_fittings(rng) for _ in range(2))
    in_rooms: list[Polygon] = []
    in_halls: list[Polygon] = []
    for room in plan.rooms:
        if room.kind == "room":
            pieces = _room_pieces(rng, room, alike[int(rng.random() < 0.3)])
            in_rooms += place_furniture([[(piece,)] for piece in pieces], room, plan)
        else:
            in_halls += place_furniture([[(piece,)] for piece in corridor_pieces(rng, room)], room, plan, in_halls)
    return (*in_halls, *in_rooms)


def _fittings(rng: np.random.Generator) -> tuple[Fitting, ...]:
    """Draw the fittings that equal offices share. Walls are named as seen from the door: far, left and right."""
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


def corridor_pieces(rng: np.random.Generator, hall: Room) -> list[Polygon]:
    """Draw cabinets and machines along the sides of a corridor or cross corridor, about one per six metres."""
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
