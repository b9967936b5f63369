"""The worlds that can be asked for by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mapping.seeds import Role, stream
from worlds.layout import Layout
from worlds.office import office
from worlds.world import World

LARGEST = 500.0
"""No world is wider or higher than this [m]."""


@dataclass(frozen=True)
class Family:
    """A kind of world: ``draw`` makes its layout for a (width, height) [m], which are ``width`` and ``height`` unless
    others are asked for; ``about`` is one line for who chooses among them."""

    draw: Callable[[np.random.Generator, float, float], Layout]
    width: float
    height: float
    about: str


FAMILIES: dict[str, Family] = {
    "office": Family(office, 30.0, 20.0, "corridors with rooms that repeat, furnished"),
}
"""Name -> family, in the order in which they are shown."""


def make_world(name: str, seed: int, width: float | None = None, height: float | None = None) -> World:
    """The world of that family and seed, of its usual size [m] unless told otherwise.

    Raises ``ValueError`` where the name is unknown, the seed negative, or a size too small to hold the family, or
    over 500 m.
    """
    if name not in FAMILIES:
        raise ValueError(f"unknown world {name!r}; known are: {', '.join(FAMILIES)}")
    family = FAMILIES[name]
    size = (family.width if width is None else float(width), family.height if height is None else float(height))
    for label, value in zip(("width", "height"), size, strict=True):
        if not 0.0 < value <= LARGEST:
            raise ValueError(f"{name}: {label} is {value:g} m, must be positive and at most {LARGEST:g} m")
    layout = family.draw(stream(seed, Role.WORLD), *size)
    return World(name, seed, size, layout.obstacles, layout.starts, layout.fence, layout.parts)
