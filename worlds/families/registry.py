"""List the families of worlds by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mapping.seeds import Role, stream
from mapping.wording import did_you_mean
from worlds.building.drawing import WorldDrawing
from worlds.families.cave import cave
from worlds.families.corridor_loop import corridor_loop
from worlds.families.disjoint import disjoint
from worlds.families.hospital import hospital
from worlds.families.house import house
from worlds.families.maze import maze
from worlds.families.office import office
from worlds.families.open_hall import open_hall
from worlds.families.outdoor import outdoor
from worlds.families.symmetric import symmetric
from worlds.families.thesis_floor import thesis_floor
from worlds.families.thesis_hall import SIZE as HALL_SIZE
from worlds.families.thesis_hall import thesis_hall
from worlds.families.warehouse import warehouse
from worlds.floor import LARGEST
from worlds.world import World


@dataclass(frozen=True)
class Family:
    """Describe a family: ``draw`` makes a layout for a (width, height) [m]; ``width`` and ``height`` are the defaults,
    ``about`` is its line in the list of worlds."""

    draw: Callable[[np.random.Generator, float, float], WorldDrawing]
    width: float
    height: float
    about: str


FAMILIES: dict[str, Family] = {
    "office": Family(office, 30.0, 20.0, "corridors with rooms that repeat, furnished"),
    "house": Family(house, 15.0, 12.0, "rooms of different use and furniture"),
    "warehouse": Family(warehouse, 40.0, 25.0, "rows of racks, aisles, a dock with pallets"),
    "maze": Family(maze, 20.0, 20.0, "narrow passages with dead ends and a few loops"),
    "corridor_loop": Family(corridor_loop, 40.0, 25.0, "corridors in two loops, closed doors, niches"),
    "hospital": Family(hospital, 60.0, 30.0, "two long wings of similar rooms"),
    "cave": Family(cave, 40.0, 40.0, "chambers and boulders without straight lines"),
    "open_hall": Family(open_hall, 30.0, 30.0, "a wide hall with pillars, booths and tables"),
    "outdoor": Family(outdoor, 60.0, 60.0, "trees, bushes, no walls; a fence invisible to lidars"),
    "symmetric": Family(symmetric, 30.0, 16.0, "rotational symmetry: two right transforms"),
    "disjoint": Family(disjoint, 40.0, 25.0, "four separate parts: every merge is wrong"),
    "thesis_hall": Family(thesis_hall, *HALL_SIZE, "hall of the thesis by Chen (2021), one size, five starts"),
    "thesis_floor": Family(thesis_floor, 49.0, 37.0, "U-shaped office floor of the thesis, three starts"),
}
"""Name -> family, in the order of the list."""


def make_world(name: str, seed: int, width: float | None = None, height: float | None = None) -> World:
    """Generate a world of that family and seed, of its default size [m] unless given.

    Raises ``ValueError`` if the name is unknown, the seed is negative, or a size is too small for the family or above
    500 m.
    """
    if name not in FAMILIES:
        raise ValueError(f"unknown world {name!r}; known are: {', '.join(FAMILIES)}{did_you_mean(name, FAMILIES)}")
    family = FAMILIES[name]
    size = (family.width if width is None else float(width), family.height if height is None else float(height))
    for label, value in zip(("width", "height"), size, strict=True):
        if not 0.0 < value <= LARGEST:
            raise ValueError(f"{name}: {label} is {value:g} m, must be positive and at most {LARGEST:g} m")
    layout = family.draw(stream(seed, Role.WORLD), *size)
    return World(name, seed, size, layout.obstacles, layout.starts, layout.fence, layout.parts)
