"""Generate buildings with a rotational symmetry of 180 degrees."""

from __future__ import annotations

import numpy as np

from mapping.arrays import frozen_array
from worlds.building.clutter import corridor_pieces, furnish
from worlds.building.drawing import WorldDrawing, require_size
from worlds.building.floor_plan import (
    WALL,
    Door,
    FloorPlan,
    Room,
    corridor_door,
    dividers,
    outer_walls,
    rooms_of_band,
    wall_along_x,
)
from worlds.building.furniture_placement import place_furniture
from worlds.polygon import Polygon


def symmetric(rng: np.random.Generator, width: float = 30.0, height: float = 16.0) -> WorldDrawing:
    """Draw different rooms on both sides of a corridor, ``width`` x ``height`` [m]. The upper half is the lower one
    rotated by 180 degrees.

    Two maps of parts of it can be aligned in two ways that are equally right. Raises ``ValueError`` below 12 x 10 m.
    """
    require_size("symmetric", width, height, (12.0, 10.0))
    half = symmetric_half(rng, width, height)
    in_rooms = furnish(rng, FloorPlan(width, height, half.rooms, half.doors, half.walls))
    corridor = Room(WALL, half.rooms[0].y1 + WALL, width / 2.0 - 1.0, height - half.rooms[0].y1 - WALL, "corridor")
    whole = _whole(half)
    in_corridor = place_furniture([[(piece,)] for piece in corridor_pieces(rng, corridor)], corridor, whole)
    pieces = (*half.walls, *in_rooms, *in_corridor)
    return WorldDrawing((*pieces, *(_turned(piece, width, height) for piece in pieces)))


def symmetric_half(rng: np.random.Generator, width: float, height: float) -> FloorPlan:
    """Draw the lower half: rooms, doors and walls, without the walls of the other half."""
    corridor = rng.uniform(1.9, 2.4)
    y1 = (height - corridor) / 2.0 - WALL
    module = rng.uniform(3.3, 4.6)
    rooms = rooms_of_band(rng, width, WALL, y1, module, inner=False, door_below=False)
    doors: list[Door] = [corridor_door(rng, room, module, {1: rng.random(), 2: rng.random()}) for room in rooms]
    walls = outer_walls(width, height)[::2] + wall_along_x(width, y1, rooms, doors) + dividers(rooms, [])
    return FloorPlan(width, height, tuple(rooms), tuple(doors), tuple(walls))


def _whole(half: FloorPlan) -> FloorPlan:
    doors = [Door(half.length - door.x, half.depth - door.y, door.width, door.along_x) for door in half.doors]
    walls = [_turned(wall, half.length, half.depth) for wall in half.walls]
    return FloorPlan(half.length, half.depth, half.rooms, (*half.doors, *doors), (*half.walls, *walls))


def _turned(polygon: Polygon, width: float, height: float) -> Polygon:
    """Rotate by 180 degrees about the centre of the building."""
    return frozen_array(np.array((width, height)) - polygon, np.float64)
