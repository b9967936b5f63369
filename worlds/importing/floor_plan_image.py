"""Read the free cells of a floor plan: a picture, or a map_server map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mapping.io.map_file import SAVED_GREYS, load_map
from mapping.io.occupancy_grey import FREE_GREY, UNKNOWN_GREY
from mapping.io.picture import read_picture
from worlds.importing.cells import DARK

INK, PAPER, GREATEST_MIDDLE = 64, 224, 0.1
"""A drawing is dark or light; a robot's map is grey where it knows nothing. Greatest share of pixels in between."""


@dataclass(frozen=True, eq=False)
class CellPlan:
    """Hold the ``free`` cells (rows, cols) of a plan, row 0 lowest, and their ``resolution`` [m].

    ``drawn`` is True if a person drew it, who may have written on it. ``notes`` are one line each about the file,
    without its name.
    """

    free: NDArray[np.bool_]
    resolution: float
    drawn: bool = False
    notes: tuple[str, ...] = ()


def read_plan_picture(path: Path, resolution: float) -> CellPlan:
    """Read a picture of a floor plan of ``resolution`` [m/pixel]: dark is wall, transparent is free.

    In a picture with exactly the greys of a map saver, unknown is solid too, and a note says so.

    Raises ``ValueError`` with the file if it is not a picture or has too many pixels; ``OSError`` if it cannot be read.
    """
    if not (math.isfinite(resolution) and resolution > 0.0):
        raise ValueError(f"{path}: the plan's resolution is {resolution:g} m a pixel, must be positive and finite")
    picture = read_picture(path)
    free = picture.grey >= DARK
    notes: tuple[str, ...] = ()
    if {UNKNOWN_GREY, FREE_GREY} <= set(np.unique(picture.grey).tolist()) <= SAVED_GREYS:
        free = picture.grey == FREE_GREY
        notes = (f"has exactly the greys of a map saver, so that {UNKNOWN_GREY}, unknown, is solid",)
    if picture.opaque is not None:
        free |= ~picture.opaque
    middle = np.count_nonzero((picture.grey > INK) & (picture.grey < PAPER))
    return CellPlan(free[::-1], resolution, drawn=int(middle) <= GREATEST_MIDDLE * picture.grey.size, notes=notes)


def read_plan_map(path: Path) -> CellPlan:
    """Read the free cells of a map_server YAML. Occupied and unknown cells are solid.

    The world's origin is the lower left corner of the picture, whatever the map's origin. Raises as
    ``read_plan_picture``.
    """
    loaded = load_map(path)
    return CellPlan(loaded.grid.free, loaded.grid.frame.resolution, notes=loaded.warnings)
