"""Generate office buildings."""

from __future__ import annotations

import numpy as np

from mapping.arrays import frozen_array
from worlds.building.clutter import furnish
from worlds.building.drawing import WorldDrawing, require_size
from worlds.building.floor_plan import draw_floor_plan
from worlds.polygon import Polygon


def office(rng: np.random.Generator, width: float = 30.0, height: float = 20.0) -> WorldDrawing:
    """Draw an office of ``width`` x ``height`` [m].

    Rooms of one size repeat along corridors, as in real buildings, so parts of it look alike. Doors are at least 0.9 m
    wide, walls 0.15 m thick, and a robot of 0.2 m radius can reach all free floor. In half of the offices the corridors
    run along x, in half along y. Raises ``ValueError`` below 10 x 10 m.
    """
    require_size("office", width, height, (10.0, 10.0))
    upright = bool(rng.random() < 0.5)
    plan = draw_floor_plan(rng, *((height, width) if upright else (width, height)))
    obstacles = (*plan.walls, *furnish(rng, plan))
    return WorldDrawing(tuple(_mirrored(polygon) for polygon in obstacles) if upright else obstacles)


def _mirrored(polygon: Polygon) -> Polygon:
    """Swap x and y, and reverse the corners to keep them counter-clockwise."""
    return frozen_array(polygon[::-1, ::-1], np.float64)
