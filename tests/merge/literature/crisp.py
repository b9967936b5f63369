"""A pair of maps without noise: two robots in parts of one world, with exact ground truth."""

from __future__ import annotations

from functools import cache

import numpy as np

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.preparation.prepared_map import PreparedMap
from tests.merge.rooms import CELL, observed, rooms, viewpoints

YAW = 0.7


@cache
def crisp_pair(scale: float = 1.0, seed: int = 2) -> tuple[PreparedMap, PreparedMap, Similarity2]:
    """Target, source and the true transform, cells to cells. The source is turned and shifted, and its cells are
    ``scale`` times as large."""
    rng = np.random.default_rng(seed)
    world = rooms(rng)
    source_from_world = Similarity2(3.0, 1.0, -YAW, 1.0 / scale)
    grids = [
        observed(world, viewpoints(world, rng, *part, number=20), frame, rng)
        for part, frame in (
            (((0.3, 0.3), (12.0, 10.7)), Similarity2()),
            (((3.5, 0.3), (15.7, 10.7)), source_from_world),
        )
    ]
    cells = [Similarity2.from_se2(grid.frame.origin, CELL) for grid in grids]
    return PreparedMap(grids[0]), PreparedMap(grids[1]), cells[0].inverse() @ source_from_world.inverse() @ cells[1]


def off_share(answer: Similarity2, truth: Similarity2, source: PreparedMap) -> float:
    """How far an answer puts the source's surface from the truth on average, as a share of its diagonal."""
    moved = answer.apply(source.points) - truth.apply(source.points)
    return float(np.hypot(*moved.T).mean() / (truth.scale * source.diagonal))


def blank(rows: int = 90, cols: int = 120) -> PreparedMap:
    """A map that knows free space alone."""
    return PreparedMap(OccupancyGrid(GridFrame(1.0, SE2(), (rows, cols)), np.full((rows, cols), -1.0, np.float32)))
