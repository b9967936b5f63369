"""Open a world by name: a family, a world file, or a floor plan."""

from __future__ import annotations

from pathlib import Path

from mapping.io.safe_load import read_yaml
from mapquilt.json_file import check_record, read_record
from worlds.families.registry import FAMILIES, make_world
from worlds.floor import require_drivable
from worlds.importing.floor_plan_image import read_plan_map, read_plan_picture
from worlds.world import World
from worlds.world_file import world_from_json

PICTURES, YAMLS = (".png", ".pgm"), (".yaml", ".yml")


def open_world(
    name: str,
    seed: int,
    width: float | None = None,
    height: float | None = None,
    plan_resolution: float | None = None,
) -> tuple[World, tuple[str, ...]]:
    """Open a world and check that robots can explore it. Returns the world and warnings about its file.

    ``width`` and ``height`` [m] are for families, ``plan_resolution`` [m/pixel] for pictures of floor plans. A world
    from a file does not depend on ``seed``. Raises ``ValueError`` or ``OSError`` with the name and the fault.
    """
    world, warnings = read_world(name, seed, width, height, plan_resolution)
    try:
        return require_drivable(world), warnings
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error


def read_world(
    name: str,
    seed: int,
    width: float | None = None,
    height: float | None = None,
    plan_resolution: float | None = None,
) -> tuple[World, tuple[str, ...]]:
    """Open a world as ``open_world`` does, without the check that robots can explore it."""
    if not name:
        raise ValueError("the name of the world is empty; `mapquilt worlds list` lists the families")
    path = Path(name)
    is_file = is_world_file(name)
    if is_file and not (width is None and height is None):
        raise ValueError(f"--width and --height: apply to families only; {name} has its own size")
    if plan_resolution is not None and path.suffix.lower() not in PICTURES:
        raise ValueError(f"--plan-resolution: applies to pictures only, not to {name}")
    if is_file:
        return _read(path, plan_resolution)
    if name not in FAMILIES:
        raise ValueError(f"unknown world {name!r}; known are: {', '.join(FAMILIES)}, and files (JSON, YAML, PNG, PGM)")
    return make_world(name, seed, width, height), ()


def is_world_file(name: str) -> bool:
    """Check if the name of a world is that of a file, whose world does not depend on a seed."""
    path = Path(name)
    return name not in FAMILIES and (path.suffix.lower() in (".json", *PICTURES, *YAMLS) or path.exists())


def _read(path: Path, plan_resolution: float | None) -> tuple[World, tuple[str, ...]]:
    ending = path.suffix.lower()
    if path.is_dir():
        raise ValueError(f"{path}: is a folder; name a world file or a floor plan")
    if ending in PICTURES:
        if plan_resolution is None:
            raise ValueError(f"{path}: a plan that is a picture needs --plan-resolution, in metres a pixel")
        return read_plan_picture(path, plan_resolution), ()
    if ending in YAMLS:
        record = read_yaml(path)
        if not isinstance(record, dict):
            raise ValueError(f"{path}: is no world file: it holds no fields")
        if "image" in record:
            return read_plan_map(path)
        check_record(path, "world", record)
    elif ending == ".json":
        record = read_record(path, "world")
    else:
        raise ValueError(f"{path}: is no world file (JSON, YAML) and no floor plan (PNG, PGM, map_server YAML)")
    try:
        return world_from_json(record, path.stem), ()
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
