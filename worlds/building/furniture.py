"""Place furniture against the walls of a room, or in its middle."""

from __future__ import annotations

import numpy as np

from worlds.building.floor_plan import Room
from worlds.building.furniture_placement import Group
from worlds.polygon import Polygon, box, turned_box

SUNK = 0.01
"""Depth [m] by which furniture overlaps its wall, so that no ray passes between them."""
SIDES = ("left", "right", "low", "high")


def against(room: Room, side: str, at: float, long: float, deep: float) -> Polygon:
    """Return a box against one side of the room, ``long`` along the wall and ``deep`` into the room [m], at the
    relative position ``at``."""
    if side in ("low", "high"):
        x = room.x0 + at * (room.width - long)
        y = room.y0 - SUNK if side == "low" else room.y1 + SUNK - deep
        return box(x, y, x + long, y + deep)
    x = room.x0 - SUNK if side == "left" else room.x1 + SUNK - deep
    y = room.y0 + at * (room.depth - long)
    return box(x, y, x + deep, y + long)


def somewhere_against(
    rng: np.random.Generator, room: Room, long: float, deep: float, tries: int = 8, corner: float = 0.5
) -> list[Group]:
    """Draw alternative placements of one piece: against any wall, with probability ``corner`` in a corner."""
    alternatives: list[Group] = []
    for _ in range(tries):
        at = float(rng.integers(0, 2)) if rng.random() < corner else rng.random()
        alternatives.append((against(room, SIDES[int(rng.integers(4))], at, long, deep),))
    return alternatives


def table_with_chairs(rng: np.random.Generator, room: Room, tries: int = 6) -> list[Group]:
    """Draw alternative placements of a table away from the walls, with two or three chairs at each long side."""
    long, wide, chairs = rng.uniform(1.4, 2.2), rng.uniform(0.8, 1.0), int(rng.integers(2, 4))
    alternatives: list[Group] = []
    for _ in range(tries):
        x, y = (float(share) for share in rng.uniform((0.25, 0.25), (0.75, 0.75)))
        place = (room.x0 + x * room.width, room.y0 + y * room.depth)
        yaw = float(rng.choice([0.0, np.pi / 2.0]) + rng.normal(0.0, 0.05))
        alternatives.append(_set_out(place, yaw, long, wide, chairs))
    return alternatives


def _set_out(place: tuple[float, float], yaw: float, long: float, wide: float, chairs: int) -> Group:
    along, across = np.array((np.cos(yaw), np.sin(yaw))), np.array((-np.sin(yaw), np.cos(yaw)))
    pieces = [turned_box(*place, long, wide, yaw)]
    for index in range(chairs):
        for side in (-1.0, 1.0):
            x, y = place + ((index + 0.5) / chairs - 0.5) * long * along + side * (wide / 2.0 + 0.08) * across
            pieces.append(turned_box(float(x), float(y), 0.42, 0.42, yaw))
    return tuple(pieces)
