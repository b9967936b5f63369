"""Read a plan of a real place as a world, whatever its format."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mapping.io.safe_load import reading
from mapping.wording import counted
from worlds.importing.cells import world_from_cells
from worlds.importing.dxf import read_dxf
from worlds.importing.floor_plan_image import CellPlan, read_plan_map, read_plan_picture
from worlds.importing.gazebo import read_sdf
from worlds.importing.houseexpo import houseexpo_world, is_houseexpo
from worlds.importing.mending import FILLED, fill_pockets, mend_cells
from worlds.importing.open_rmf import building_world, is_building
from worlds.importing.svg import read_svg
from worlds.importing.text import find_text
from worlds.importing.vector_map import is_vector_map, vector_map_world
from worlds.world import World

PICTURES = (".png", ".pgm", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".ppm")
SCALED = (*PICTURES, ".svg", ".dxf")
"""Endings of the plans that a resolution applies to."""
DRAWINGS = (".svg", ".dxf", ".sdf", ".world")

Read = tuple[World, tuple[str, ...]]
"""A world, and notes about its file and on what was mended, one line each."""


@dataclass(frozen=True)
class PlanOptions:
    """Choose how a plan is read: its ``resolution`` [m/pixel, or m/unit of a drawing], the ``level`` of a building, and
    whether it is ``mended`` so that robots can explore it. None: as the file states."""

    resolution: float | None = None
    level: str | None = None
    mended: bool = False


def is_plan(value: Any) -> bool:
    """Check if the value of a JSON or YAML file is a plan: a map, a house, a building or a vector map."""
    is_map = isinstance(value, dict) and "image" in value
    return is_map or is_houseexpo(value) or is_building(value) or is_vector_map(value)


def read_plan(path: Path, value: Any, options: PlanOptions) -> Read:
    """Read a plan: a picture or drawing by the ending of ``path``, or else the ``value`` of its JSON or YAML.

    Raises ``ValueError`` with the file and the fault, ``OSError`` if it cannot be read.
    """
    with reading(path):
        if options.level is not None and not is_building(value):
            raise ValueError("has no levels, for which --level is")
        world, notes = _read(path, value, options)
        if options.mended:
            world, filled = fill_pockets(world)
            told = any(note.startswith(FILLED) for note in notes)
            notes = notes if told else (*notes, *filled)
    return world, tuple(note if note.startswith(f"{path}: ") else f"{path}: {note}" for note in notes)


def _read(path: Path, value: Any, options: PlanOptions) -> Read:
    ending = path.suffix.lower()
    if options.resolution is not None and not (math.isfinite(options.resolution) and options.resolution > 0.0):
        raise ValueError(f"the plan's resolution is {options.resolution:g} m a pixel, must be positive and finite")
    if ending in (*PICTURES, ".svg") and options.resolution is None:
        raise ValueError(
            "a plan that is a picture needs --plan-resolution (plan_resolution of a data set), in metres a pixel"
        )
    if ending in PICTURES:
        return _of_cells(path, read_plan_picture(path, options.resolution or 0.0), options.mended)
    if ending == ".svg":
        return read_svg(path, options.resolution or 0.0)
    if ending == ".dxf":
        return read_dxf(path, options.resolution)
    if ending in (".sdf", ".world"):
        return read_sdf(path)
    if is_building(value):
        return building_world(path.stem.removesuffix(".building"), value, options.level), ()
    if is_houseexpo(value):
        return houseexpo_world(path.stem, value), ()
    if is_vector_map(value):
        return vector_map_world(path.stem.removesuffix(".vectormap"), value), ()
    return _of_cells(path, read_plan_map(path), options.mended)


def _of_cells(path: Path, plan: CellPlan, mended: bool) -> Read:
    if not mended:
        letters = len(find_text(plan.free, plan.resolution)[1]) if plan.drawn else 0
        solids = counted(letters, "solid that looks", "solids that look")
        notes = (f"has {solids} like letters of text; --from-map drops them",) if letters else ()
        return world_from_cells(path.stem, plan.free, plan.resolution), (*plan.notes, *notes)
    cells = mend_cells(plan.free, plan.resolution, drawn=plan.drawn)
    return world_from_cells(path.stem, cells.free, cells.resolution), (*plan.notes, *cells.notes)
