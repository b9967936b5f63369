"""Place furniture without blocking doors, leaving narrow gaps or dividing the floor."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from worlds.building.floor_plan import Door, FloorPlan, Room
from worlds.polygon import Polygon, contains, distances, edges

PASSAGE = 0.65
"""Least gap between two pieces that do not touch [m]."""
DOOR_FREE = 0.75
"""Least distance of furniture from the edge of a door [m]."""
Group = tuple[Polygon, ...]
"""Pieces that belong together, such as a table and its chairs."""


def place_furniture(
    items: Iterable[Sequence[Group]], room: Room, plan: FloorPlan, standing: Sequence[Polygon] = ()
) -> list[Polygon]:
    """Place each item by the first of its alternatives that fits; drop the items that do not fit.

    A group is placed or dropped as a whole. Pieces keep clear of doors, leave no narrow gaps to walls, to ``standing``
    pieces and to each other, and the floor stays connected.
    """
    walls = [wall for wall in plan.walls if _is_near(wall, room)]
    doors = [door for door in plan.doors if _is_near(np.array([(door.x, door.y)]), room)]
    points = _floor_points(room)
    floor = np.logical_and.reduce([_leaves_free(wall, points) for wall in walls])
    kept: list[Polygon] = []
    for alternatives in items:
        for group in alternatives:
            if any(_is_tight(piece, walls, (*standing, *kept)) or not _keeps_doors(piece, doors) for piece in group):
                continue
            left = np.logical_and.reduce([floor, *(_leaves_free(piece, points) for piece in group)])
            if _is_one_piece(left):
                kept += group
                floor = left
                break
    return kept


def _is_tight(piece: Polygon, walls: Sequence[Polygon], things: Sequence[Polygon]) -> bool:
    return any(gap_between(piece, other) < PASSAGE for other in things) or any(
        0.0 < gap_between(piece, wall) < PASSAGE for wall in walls
    )


def _is_near(points: Polygon, room: Room) -> bool:
    low, high = points.min(axis=0), points.max(axis=0)
    return bool(
        low[0] < room.x1 + 1.0 and high[0] > room.x0 - 1.0 and low[1] < room.y1 + 1.0 and high[1] > room.y0 - 1.0
    )


def gap_between(one: Polygon, other: Polygon) -> float:
    """Return the distance between two convex polygons [m], 0 if a corner of one lies in the other. Beyond ``PASSAGE``
    it is a lower bound."""
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
    """Return points [m] on the floor of the room, (rows, cols, 2)."""
    x, y = np.arange(room.x0, room.x1, step), np.arange(room.y0, room.y1, step)
    return np.stack(np.meshgrid(x, y), axis=-1)


def _leaves_free(solid: Polygon, points: NDArray[np.float64], radius: float = 0.25) -> NDArray[np.bool_]:
    """Return at which of the points (rows, cols, 2) a robot of ``radius`` [m] does not touch the solid."""
    free = np.ones(points.shape[:2], dtype=np.bool_)
    low, high = solid.min(axis=0) - radius, solid.max(axis=0) + radius
    near = ((points >= low) & (points <= high)).all(axis=2)
    free[near] = (distances(edges(solid), points[near]) >= radius) & ~contains(solid, points[near])
    return free


def _is_one_piece(floor: NDArray[np.bool_]) -> bool:
    return bool(ndimage.label(floor, structure=np.ones((3, 3)))[1] == 1)
