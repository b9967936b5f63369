"""Read a world from a floor plan: a picture, or a map_server map."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mapping.io.map_file import load_map
from mapping.io.picture import read_picture
from worlds.polygon import Polygon, box
from worlds.world import World

DARK = 128
"""Grey levels below this are walls in a picture."""
MAX_BOXES = 10_000
"""Most boxes that fit into the one mesh of the physics."""
BORDER_WALL = 0.1
"""Least thickness of the wall that closes an open plan [m]."""
INDOORS = 0.2
"""If at least this fraction of the free cells is in parts that do not touch the picture's border, the others are
outdoors."""


def read_plan_picture(path: Path, resolution: float) -> World:
    """Read a floor plan, PNG or PGM, of ``resolution`` [m/pixel]: dark is wall, transparent is free.

    Raises ``ValueError`` with the file if it is not a picture, has too many pixels, too much detail or no free cell;
    ``OSError`` if it cannot be read.
    """
    if not (math.isfinite(resolution) and resolution > 0.0):
        raise ValueError(f"{path}: the plan's resolution is {resolution:g} m a pixel, must be positive and finite")
    picture = read_picture(path)
    free = picture.grey >= DARK
    if picture.opaque is not None:
        free |= ~picture.opaque
    return _world(path, free[::-1], resolution)


def read_plan_map(path: Path) -> tuple[World, tuple[str, ...]]:
    """Read a map_server YAML as a world, with warnings about the file. Occupied and unknown cells are solid.

    The world's origin is the lower left corner of the picture, whatever the map's origin. Raises ``ValueError`` and
    ``OSError`` as ``read_plan_picture``.
    """
    loaded = load_map(path)
    world = _world(path, loaded.grid.free, loaded.grid.frame.resolution)
    return world, tuple(f"{path}: {warning}" for warning in loaded.warnings)


def world_from_cells(name: str, free: NDArray[np.bool_], resolution: float) -> World:
    """Build a world from ``free`` cells (rows, cols), row 0 lowest, of ``resolution`` [m]; all other cells are solid.

    Edges lie exactly on cell borders. Outdoor areas become solid; a plan that is open at its border gets a wall around
    it. Raises ``ValueError`` if no cell is free, or more than 10,000 boxes are needed.
    """
    if not free.any():
        raise ValueError("the plan has no free cell")
    indoors = _closed(free, math.ceil(BORDER_WALL / resolution - 1e-9))
    boxes = _boxes(~indoors, resolution)
    if len(boxes) > MAX_BOXES:
        raise ValueError(f"the plan's solids take {len(boxes)} boxes, at most {MAX_BOXES} can be simulated: coarsen it")
    rows, cols = indoors.shape
    return World(name, 0, (cols * resolution, rows * resolution), tuple(boxes))


def _world(path: Path, free: NDArray[np.bool_], resolution: float) -> World:
    try:
        return world_from_cells(path.stem, free, resolution)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _closed(free: NDArray[np.bool_], wall_cells: int) -> NDArray[np.bool_]:
    labels, _ = ndimage.label(free)
    at_border = np.unique(np.concatenate((labels[[0, -1]].ravel(), labels[:, [0, -1]].ravel())))
    indoors = free & ~np.isin(labels, at_border)
    if indoors.sum() >= INDOORS * free.sum():
        return indoors
    return np.pad(free, wall_cells) if at_border.any() else free


def _boxes(solid: NDArray[np.bool_], resolution: float) -> list[Polygon]:
    """Merge the solid cells into rectangles: equal runs along rows, or along columns if those are fewer."""
    along_x, along_y = _rectangles(solid), _rectangles(solid.T)
    if len(along_y) < len(along_x):
        along_x = along_y[:, [2, 3, 0, 1]]
    return [box(*(float(each) * resolution for each in corners)) for corners in along_x[:, [0, 2, 1, 3]]]


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
