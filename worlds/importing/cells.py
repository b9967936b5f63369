"""Build worlds from free cells: each maximal run of solid cells becomes a box."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from worlds.polygon import Polygon, box
from worlds.world import World

DARK = 128
"""Grey levels below this are walls in a picture or drawing."""
MAX_BOXES = 10_000
"""Most boxes of a plan, so that rays and the search for clear places stay fast."""
BORDER_WALL = 0.1
"""Least thickness of the wall that closes an open plan [m]."""
INDOORS = 0.2
"""If at least this fraction of the free cells is in parts that do not touch the plan's border, the others are
outdoors."""


def world_from_cells(name: str, free: NDArray[np.bool_], resolution: float) -> World:
    """Build a world from ``free`` cells (rows, cols), row 0 lowest, of ``resolution`` [m]; all other cells are solid.

    Edges lie exactly on cell borders. Outdoor areas become solid; a plan that is open at its border gets a wall around
    it. Raises ``ValueError`` if no cell is free, or more than 10,000 boxes are needed.
    """
    if not free.any():
        raise ValueError("the plan has no free cell")
    indoors = enclosed_cells(free, resolution)
    boxes = cell_boxes(~indoors, resolution)
    if len(boxes) > MAX_BOXES:
        raise ValueError(
            f"the plan's solids take {len(boxes)} boxes, at most {MAX_BOXES} can be simulated: coarsen it, or let "
            "`mapquilt worlds make --from-map` do so"
        )
    rows, cols = indoors.shape
    return World(name, 0, (cols * resolution, rows * resolution), tuple(boxes))


def enclosed_cells(free: NDArray[np.bool_], resolution: float) -> NDArray[np.bool_]:
    """Return the free cells without those outdoors, or with a solid border around them if the plan is open."""
    outdoors = outdoor_cells(free)
    if outdoors is None:
        return np.pad(free, math.ceil(BORDER_WALL / resolution - 1e-9))
    return free & ~outdoors


def outdoor_cells(free: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    """Return the free cells that are connected with the border, None if these are the plan itself, which is open."""
    labels, _ = ndimage.label(free)
    at_border = np.unique(np.concatenate((labels[[0, -1]].ravel(), labels[:, [0, -1]].ravel())))
    outdoors: NDArray[np.bool_] = free & np.isin(labels, at_border)
    return None if free.sum() - outdoors.sum() < INDOORS * free.sum() else outdoors


def cell_boxes(solid: NDArray[np.bool_], resolution: float) -> list[Polygon]:
    """Merge the solid cells into rectangles: equal runs along rows, or along columns if those are fewer."""
    along_x, along_y = _rectangles(solid), _rectangles(solid.T)
    if len(along_y) < len(along_x):
        along_x = along_y[:, [2, 3, 0, 1]]
    return [box(*(float(each) * resolution for each in corners)) for corners in along_x[:, [0, 2, 1, 3]]]


def box_count(solid: NDArray[np.bool_]) -> int:
    """Count the rectangles of ``cell_boxes``."""
    return min(len(_rectangles(solid)), len(_rectangles(solid.T)))


def _rectangles(solid: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return rows of first and last column border, first and last row border, (N, 4)."""
    changes = np.diff(np.pad(solid, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, first = np.nonzero(changes == 1)
    last = np.nonzero(changes == -1)[1]
    order = np.lexsort((row, last, first))
    row, first, last = row[order], first[order], last[order]
    begins = np.ones(len(row), dtype=np.bool_)
    begins[1:] = (np.diff(first) != 0) | (np.diff(last) != 0) | (np.diff(row) != 1)
    starts = np.flatnonzero(begins)
    ends = np.append(starts[1:], len(row)) - 1
    return np.stack((first[starts], last[starts], row[starts], row[ends] + 1), axis=-1).astype(np.int64).reshape(-1, 4)
