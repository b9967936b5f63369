"""Build worlds from the walls and solids of a drawing."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from worlds.floor import LARGEST
from worlds.importing.cells import BORDER_WALL, MAX_BOXES, cell_boxes, outdoor_cells
from worlds.polygon import Polygon, box, is_simple, signed_area, turned_box
from worlds.raster import true_raster
from worlds.world import MAX_CORNERS, World

CELL = 0.05
"""Cell size of the raster on which outdoor areas are searched [m], as in the check that a world can be explored."""


def wall(start: ArrayLike, end: ArrayLike, thickness: float) -> Polygon | None:
    """Return the box about a wall from ``start`` to ``end`` [m], which it exceeds by half its ``thickness`` [m].

    Walls that meet so fill their corner. None for a wall without length.
    """
    (x0, y0), (x1, y1) = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    length = math.hypot(x1 - x0, y1 - y0)
    if length == 0.0:
        return None
    yaw = math.atan2(y1 - y0, x1 - x0)
    return turned_box((x0 + x1) / 2.0, (y0 + y1) / 2.0, length + thickness, thickness, yaw)


def walls(segments: Iterable[ArrayLike], thickness: float) -> list[Polygon]:
    """Return the boxes about walls, each a start and an end [m], (2, 2), without repetitions."""
    different = dict.fromkeys(tuple(map(tuple, np.asarray(each, dtype=np.float64).tolist())) for each in segments)
    boxes = (wall(start, end, thickness) for start, end in different)
    return [each for each in boxes if each is not None]


def chain(points: NDArray[np.float64], closed: bool) -> NDArray[np.float64]:
    """Return the segments (M, 2, 2) along points (N, 2), with the one back to the first if ``closed``."""
    ends = np.roll(points, -1, axis=0)
    return np.stack((points, ends), axis=1)[: None if closed else -1]


def as_solid(points: NDArray[np.float64]) -> Polygon | None:
    """Return the points (N, 2) as a polygon that runs counter-clockwise, None if they enclose no simple area.

    Raises ``ValueError`` if it has more corners than a world's polygon may have.
    """
    corners = points[np.any(points != np.roll(points, 1, axis=0), axis=1)]
    if len(corners) > MAX_CORNERS:
        raise ValueError(f"a polygon of the plan has {len(corners)} corners, must have at most {MAX_CORNERS}")
    if len(corners) < 3 or signed_area(corners) == 0.0 or not is_simple(corners):
        return None
    return corners if signed_area(corners) > 0.0 else corners[::-1]


def world_from_solids(name: str, solids: Sequence[Polygon]) -> World:
    """Build a world from the ``solids`` of a drawing, in metres in a frame of its own.

    The lower left corner of the world lies 0.1 m outside of all solids. Areas outdoors become solid; a drawing that
    is open gets a wall around it. Raises ``ValueError`` if there is no solid, more than 10,000, or a size above 500 m.
    """
    if not solids:
        raise ValueError("the plan has no wall and no solid")
    corners = np.concatenate(solids)
    if not np.isfinite(corners).all():
        raise ValueError("a corner of the plan is not finite")
    low = corners.min(axis=0) - BORDER_WALL
    size = corners.max(axis=0) + BORDER_WALL - low
    if size.max() > LARGEST:
        raise ValueError(
            f"the plan is {size[0]:g} x {size[1]:g} m large, must be at most {LARGEST:g} m; check its unit"
        )
    width, height = (float(each) for each in size)
    world = World(name, 0, (width, height), tuple(np.clip(each - low, 0.0, size) for each in solids))
    free = true_raster(world, CELL).free
    outdoors = outdoor_cells(free)
    if outdoors is None:
        t = BORDER_WALL
        closing = [box(0, 0, width, t), box(0, height - t, width, height)]
        closing += [box(0, 0, t, height), box(width - t, 0, width, height)]
    else:
        closing = [np.minimum(each, size) for each in cell_boxes(outdoors, CELL)]
    if len(solids) + len(closing) > MAX_BOXES:
        raise ValueError(
            f"the plan has {len(solids)} walls and solids, at most {MAX_BOXES - len(closing)} can be simulated"
        )
    return replace(world, obstacles=(*world.obstacles, *closing))
