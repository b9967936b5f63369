"""Generate houses."""

from __future__ import annotations

import numpy as np

from worlds.building.drawing import WorldDrawing, require_size
from worlds.building.floor_plan import FloorPlan, Room
from worlds.building.furniture import SIDES, against, somewhere_against, table_with_chairs
from worlds.building.furniture_placement import Group, place_furniture
from worlds.building.partition import partition
from worlds.polygon import Polygon, box, disc


def house(rng: np.random.Generator, width: float = 15.0, height: float = 12.0) -> WorldDrawing:
    """Draw a house of ``width`` x ``height`` [m]: different rooms around a living room, each furnished for its use.

    Doors are at least 0.9 m wide, walls 0.15 m thick. Raises ``ValueError`` below 8 x 7 m.
    """
    require_size("house", width, height, (8.0, 7.0))
    plan = partition(rng, width, height)
    return WorldDrawing((*plan.walls, *_furniture(rng, plan)))


def _furniture(rng: np.random.Generator, plan: FloorPlan) -> list[Polygon]:
    by_size = sorted(plan.rooms, key=lambda room: -room.width * room.depth)
    pieces = []
    for rank, room in enumerate(by_size):
        if rank == 0:
            items = _living(rng, room)
        elif rank == 1:
            items = _kitchen(rng, room)
        elif rank == len(by_size) - 1:
            items = _bath(rng, room)
        else:
            items = _study(rng, room) if rng.random() < 0.25 else _bedroom(rng, room)
        pieces += place_furniture(items, room, plan)
    return pieces


def _living(rng: np.random.Generator, room: Room) -> list[list[Group]]:
    return [
        [_seats(rng, room, SIDES[int(rng.integers(4))], rng.uniform(0.3, 0.7)) for _ in range(8)],
        somewhere_against(rng, room, rng.uniform(1.4, 2.2), 0.45),
        table_with_chairs(rng, room),
        somewhere_against(rng, room, rng.uniform(0.8, 1.6), 0.35),
        somewhere_against(rng, room, 0.8, 0.8, corner=1.0),
        [_plant(rng, room) for _ in range(4)],
    ]


def _seats(rng: np.random.Generator, room: Room, side: str, at: float) -> Group:
    """Return a sofa against a wall and a low table in front of it."""
    sofa = against(room, side, at, rng.uniform(1.8, 2.4), 0.9)
    middle = sofa.mean(axis=0)
    into = {"left": (1.0, 0.0), "right": (-1.0, 0.0), "low": (0.0, 1.0), "high": (0.0, -1.0)}[side]
    x, y = middle + np.array(into) * (0.45 + 0.75 + 0.3)
    half = (0.3, 0.5) if into[0] else (0.5, 0.3)
    return sofa, box(x - half[0], y - half[1], x + half[0], y + half[1])


def _kitchen(rng: np.random.Generator, room: Room) -> list[list[Group]]:
    counters: list[Group] = []
    for side in rng.permutation(np.array(SIDES)):
        length = room.width if side in ("low", "high") else room.depth
        counters += [(against(room, str(side), share, long * length, 0.6),) for long in (1.0, 0.6) for share in (0, 1)]
    return [counters, somewhere_against(rng, room, 0.7, 0.65, corner=1.0), table_with_chairs(rng, room)]


def _bedroom(rng: np.random.Generator, room: Room) -> list[list[Group]]:
    wide = float(rng.choice([0.9, 1.4, 1.8]))
    return [
        somewhere_against(rng, room, wide, 2.05, tries=12),
        somewhere_against(rng, room, rng.uniform(1.2, 2.2), 0.6, tries=12, corner=0.8),
        somewhere_against(rng, room, rng.uniform(0.8, 1.2), 0.5),
        somewhere_against(rng, room, 0.45, 0.4),
    ]


def _study(rng: np.random.Generator, room: Room) -> list[list[Group]]:
    return [
        somewhere_against(rng, room, rng.uniform(1.4, 1.8), 0.75),
        somewhere_against(rng, room, rng.uniform(1.6, 2.6), 0.35),
        somewhere_against(rng, room, rng.uniform(0.8, 1.6), 0.35),
        [_plant(rng, room) for _ in range(4)],
    ]


def _bath(rng: np.random.Generator, room: Room) -> list[list[Group]]:
    return [
        somewhere_against(rng, room, 1.7, 0.75, corner=1.0),
        somewhere_against(rng, room, 0.6, 0.45),
        somewhere_against(rng, room, 0.4, 0.65),
    ]


def _plant(rng: np.random.Generator, room: Room) -> Group:
    radius = rng.uniform(0.16, 0.28)
    x = room.x0 + radius if rng.random() < 0.5 else room.x1 - radius
    y = room.y0 + radius if rng.random() < 0.5 else room.y1 - radius
    return (disc(x, y, radius + 0.02, corners=14),)
