"""The worlds that can be asked for by name."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mapping.seeds import Role, stream
from worlds.office import office
from worlds.polygon import Polygon
from worlds.world import World

Family = Callable[[np.random.Generator, float, float], tuple[Polygon, ...]]

FAMILIES: dict[str, tuple[Family, float, float]] = {"office": (office, 30.0, 20.0)}
"""Name -> the function that draws it, and its usual width and height [m]."""


def make_world(name: str, seed: int) -> World:
    """The world of that family and seed. Raises ``ValueError`` where the name is unknown or the seed negative."""
    if name not in FAMILIES:
        raise ValueError(f"unknown world {name!r}; known are: {', '.join(sorted(FAMILIES))}")
    family, width, height = FAMILIES[name]
    return World(name, seed, (width, height), family(stream(seed, Role.WORLD), width, height))
