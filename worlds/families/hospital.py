"""Generate hospitals."""

from __future__ import annotations

import numpy as np

from worlds.building.clutter import corridor_pieces
from worlds.building.drawing import WorldDrawing, require_size
from worlds.building.floor_plan import WALL, Door, FloorPlan, Room, dividers, outer_walls, wall_along_x
from worlds.building.furniture import against, somewhere_against
from worlds.building.furniture_placement import Group, place_furniture
from worlds.polygon import Polygon, box

CORRIDOR, HALL, MODULE = 2.4, 4.0, 3.8
"""Width of the corridors, of the halls between the wings, and approximate width of a room [m]."""


def hospital(rng: np.random.Generator, width: float = 60.0, height: float = 30.0) -> WorldDrawing:
    """Draw a hospital of ``width`` x ``height`` [m]: two long wings of equal rooms, joined by two halls between
    courtyards.

    A room has a bed and a bathroom at the door, or two beds; one in eight is a store. Raises ``ValueError`` below 30 x
    22 m.
    """
    require_size("hospital", width, height, (30.0, 22.0))
    plan = hospital_plan(rng, width, height)
    return WorldDrawing((*plan.walls, *_furniture(rng, plan)))


def hospital_plan(rng: np.random.Generator, width: float, height: float) -> FloorPlan:
    """Draw the floor without furniture. The courtyards between the wings are solid."""
    room_depth = (height * rng.uniform(0.76, 0.8) / 2.0 - CORRIDOR - 4.0 * WALL) / 2.0
    halls = (width * rng.uniform(0.2, 0.28), width * rng.uniform(0.7, 0.78))
    share = rng.uniform(0.0, 0.04)
    rooms: list[Room] = []
    doors: list[Door] = []
    walls = outer_walls(width, height)
    for upper in (False, True):
        y0 = height - WALL - 2.0 * room_depth - 2.0 * WALL - CORRIDOR if upper else WALL
        corridor = y0 + room_depth + WALL
        rooms.append(Room(WALL, corridor, width - WALL, corridor + CORRIDOR, "corridor"))
        for above in (False, True):
            low = corridor + CORRIDOR + WALL if above else y0
            inner = above != upper
            row = _row(rng, width, low, low + room_depth, halls if inner else (), door_below=above)
            entered = [room for room in row if room.kind != "cross"]
            # Like rooms stand back to back, bath to bath, so that every other door is at the other end of its room.
            row_doors = [_door(rng, room, share if k % 2 else 1.0 - share) for k, room in enumerate(entered)]
            walls += wall_along_x(width, low - WALL if above else low + room_depth, row, row_doors)
            walls += dividers(row, [])
            if inner:
                walls += wall_along_x(width, low + room_depth if above else low - WALL, row, [])
            rooms += row
            doors += row_doors
    wing = 2.0 * room_depth + 3.0 * WALL + CORRIDOR
    for start, end in _between_halls(width, halls):
        walls.append(box(start, wing, end, height - wing))
    rooms += [Room(x, wing + WALL, x + HALL, height - wing - WALL, "hall") for x in halls]
    return FloorPlan(width, height, tuple(rooms), tuple(doors), tuple(walls))


def _between_halls(width: float, halls: tuple[float, ...]) -> list[tuple[float, float]]:
    borders = [0.0, *(border for x in halls for border in (x, x + HALL)), width]
    return list(zip(borders[::2], borders[1::2], strict=True))


def _row(
    rng: np.random.Generator, width: float, y0: float, y1: float, halls: tuple[float, ...], door_below: bool
) -> list[Room]:
    """Return equal rooms from end to end, with the openings of the halls between them."""
    row: list[Room] = []
    stretches = [(max(a, WALL), min(b, width - WALL)) for a, b in _between_halls(width, halls)]
    for index, (start, end) in enumerate(stretches):
        start += WALL if index > 0 else 0.0
        end -= WALL if index < len(stretches) - 1 else 0.0
        count = max(1, round((end - start) / MODULE))
        each = (end - start - (count - 1) * WALL) / count
        for number in range(count):
            x = start + number * (each + WALL)
            row.append(Room(x, y0, x + each, y1, "room" if rng.random() < 0.88 else "store", door_below))
        if index < len(halls):
            row.append(Room(halls[index], y0, halls[index] + HALL, y1, "cross"))
    return row


def _door(rng: np.random.Generator, room: Room, share: float) -> Door:
    width = rng.uniform(1.1, 1.2)
    margin = 0.2 + width / 2.0
    x = room.x0 + margin + share * (room.width - 2.0 * margin)
    return Door(x, room.y0 - WALL / 2.0 if room.door_below else room.y1 + WALL / 2.0, width, along_x=True)


def _furniture(rng: np.random.Generator, plan: FloorPlan) -> list[Polygon]:
    in_rooms: list[Polygon] = []
    in_halls: list[Polygon] = []
    for room in plan.rooms:
        if room.kind == "room":
            door = min(plan.doors, key=lambda each: abs(each.x - (room.x0 + room.x1) / 2.0) + _off(each, room))
            in_rooms += place_furniture(_ward(rng, room, door), room, plan)
        elif room.kind == "store":
            shelves = [somewhere_against(rng, room, rng.uniform(1.0, 2.5), rng.uniform(0.4, 0.6)) for _ in range(5)]
            in_rooms += place_furniture(shelves, room, plan)
        elif room.kind == "corridor":
            in_halls += place_furniture([[(piece,)] for piece in corridor_pieces(rng, room)], room, plan, in_halls)
        elif room.kind == "hall":
            in_halls += place_furniture([[_desk(rng, room)]], room, plan, in_halls)
    return in_halls + in_rooms


def _off(door: Door, room: Room) -> float:
    """Return a large value if the door is not in the room's corridor wall."""
    return 1e3 * abs(door.y - (room.y0 - WALL / 2.0 if room.door_below else room.y1 + WALL / 2.0))


def _ward(rng: np.random.Generator, room: Room, door: Door) -> list[list[Group]]:
    """Draw a bed behind a bathroom at the door, or two beds, with their heads to the wall; a locker and a chair."""
    bath_side = 1.0 if door.x < (room.x0 + room.x1) / 2.0 else 0.0
    front, far = ("low", "high") if room.door_below else ("high", "low")
    bed_side, other = ("right", "left") if bath_side == 1.0 else ("left", "right")
    into = 1.0 if room.door_below else -1.0
    single = rng.random() < 0.75
    beds = [0.74] if single else [0.25, 0.74]
    items: list[list[Group]] = [[(against(room, front, bath_side, 1.3, 1.6),)]] if single else []
    for share in beds:
        at = (share if into > 0.0 else 1.0 - share) + rng.normal(0.0, 0.01)
        items.append([(against(room, bed_side, float(np.clip(at, 0.0, 1.0)), 0.95, 2.05),)])
    items.append([(against(room, other, 0.8 if into > 0.0 else 0.2, 0.9, 0.5),)])
    if rng.random() < 0.4:
        items.append([(against(room, far, rng.random(), 0.55, 0.55),) for _ in range(3)])
    return items


def _desk(rng: np.random.Generator, hall: Room) -> Group:
    """Draw a desk against a side of the hall."""
    side = "left" if rng.random() < 0.5 else "right"
    return (against(hall, side, rng.uniform(0.2, 0.8), min(2.4, 0.7 * hall.depth), 1.0),)
