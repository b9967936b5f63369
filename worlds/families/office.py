"""An office building."""

from __future__ import annotations

import numpy as np

from mapping.arrays import frozen_array
from worlds.building.clutter import furnish
from worlds.building.drawing import WorldDrawing, require_size
from worlds.building.floor_plan import lay_out
from worlds.polygon import Polygon


def office(rng: np.random.Generator, width: float = 30.0, height: float = 20.0) -> WorldDrawing:
    """Draw an office of ``width`` x ``height`` [m].

    Rooms of one size repeat along corridors, as in real buildings, so that parts of it look alike; doors are at
    least 0.9 m wide, walls 0.15 m thick, and all free floor is reachable for a robot of 0.2 m radius. Half of the
    offices have their corridors along x, half along y. Raises ``ValueError`` where the size is too small.
    """
    require_size("office", width, height, (10.0, 10.0))
    upright = bool(rng.random() < 0.5)
    plan = lay_out(rng, *((height, width) if upright else (width, height)))
    obstacles = (*plan.walls, *furnish(rng, plan))
    return WorldDrawing(tuple(_mirrored(polygon) for polygon in obstacles) if upright else obstacles)


def _mirrored(polygon: Polygon) -> Polygon:
    """Swap x and y; the corners then run the other way, so turn their order too."""
    return frozen_array(polygon[::-1, ::-1], np.float64)
