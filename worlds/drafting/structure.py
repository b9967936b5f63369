"""Tell walls, solid blocks, furniture and doors apart, from the plain geometry of a world."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from worlds.polygon import Polygon, box
from worlds.world import World


@dataclass(frozen=True)
class StructureSettings:
    """Bounds [m, m^2] of what counts as structure.

    - ``thickest_wall``: a solid at most so wide is a wall; furniture is wider;
    - ``least_block``: a wider solid of at least this area is a block, such as a shaft or a courtyard; furniture is
      smaller;
    - ``narrowest_door``, ``widest_door``: such a gap between two walls of one line is a door;
    - ``shortest_wall``: shorter pieces, such as the uprights of racks, have no doors between them.
    """

    thickest_wall: float = 0.25
    least_block: float = 6.0
    narrowest_door: float = 0.7
    widest_door: float = 1.4
    shortest_wall: float = 0.2


@dataclass(frozen=True)
class DoorGap:
    """Describe a gap between two walls of one line: its rectangle ``x0, y0, x1, y1`` [m]; the wall runs ``along_x``."""

    x0: float
    y0: float
    x1: float
    y1: float
    along_x: bool

    @property
    def width(self) -> float:
        return self.x1 - self.x0 if self.along_x else self.y1 - self.y0


@dataclass(frozen=True, eq=False)
class Structure:
    """Hold the solids of a world by kind: ``walls``, ``blocks`` and ``furniture``; and its ``doors``."""

    walls: tuple[Polygon, ...]
    blocks: tuple[Polygon, ...]
    furniture: tuple[Polygon, ...]
    doors: tuple[DoorGap, ...]


def find_structure(world: World, settings: StructureSettings = StructureSettings()) -> Structure:
    """Sort the solids of a world into walls, blocks and furniture, by width and area; find doors between walls."""
    walls: list[Polygon] = []
    blocks: list[Polygon] = []
    furniture: list[Polygon] = []
    for polygon in world.obstacles:
        sides = cv2.minAreaRect(polygon.astype(np.float32))[1]
        if min(sides) <= settings.thickest_wall + 1e-6:
            walls.append(polygon)
        elif sides[0] * sides[1] >= settings.least_block:
            blocks.append(polygon)
        else:
            furniture.append(polygon)
    return Structure(tuple(walls), tuple(blocks), tuple(furniture), _doors(walls, settings))


def _doors(walls: Sequence[Polygon], settings: StructureSettings) -> tuple[DoorGap, ...]:
    """Find the gaps between neighbours in lines of axis-aligned walls."""
    lines: dict[tuple[bool, float, float], list[tuple[float, float]]] = defaultdict(list)
    for wall in walls:
        (x0, y0), (x1, y1) = wall.min(axis=0).tolist(), wall.max(axis=0).tolist()
        if len(wall) != 4 or not np.array_equal(np.sort(wall, axis=0), np.sort(box(x0, y0, x1, y1), axis=0)):
            continue
        if max(x1 - x0, y1 - y0) < settings.shortest_wall:
            continue
        if x1 - x0 >= y1 - y0:
            lines[True, round(y0, 3), round(y1, 3)].append((x0, x1))
        if y1 - y0 >= x1 - x0:
            lines[False, round(x0, 3), round(x1, 3)].append((y0, y1))
    doors = []
    for (along_x, low, high), runs in lines.items():
        for (_, end), (start, _) in pairwise(sorted(runs)):
            if settings.narrowest_door <= start - end <= settings.widest_door:
                ends = (end, low, start, high) if along_x else (low, end, high, start)
                doors.append(DoorGap(*ends, along_x=along_x))
    return tuple(doors)
