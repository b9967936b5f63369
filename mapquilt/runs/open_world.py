"""Open a world by name: a family, a world file, or a plan of a real place."""

from __future__ import annotations

from pathlib import Path

from mapping.io.safe_load import read_json, read_yaml, reading
from mapping.wording import did_you_mean
from mapquilt.json_file import check_record
from worlds.families.registry import FAMILIES, make_world
from worlds.floor import require_drivable
from worlds.importing.mending import fill_pockets
from worlds.importing.plan_file import DRAWINGS, PICTURES, SCALED, PlanOptions, is_plan, read_plan
from worlds.world import World
from worlds.world_file import world_from_json

YAMLS = (".yaml", ".yml")


def open_world(
    name: str,
    seed: int,
    width: float | None = None,
    height: float | None = None,
    plan: PlanOptions = PlanOptions(),
) -> tuple[World, tuple[str, ...]]:
    """Open a world and check that robots can explore it. Returns the world and notes about its file.

    ``width`` and ``height`` [m] are for families, ``plan`` for plans of real places. A world from a file does not
    depend on ``seed``. Raises ``ValueError`` or ``OSError`` with the name and the fault.
    """
    world, notes = read_world(name, seed, width, height, plan)
    try:
        return require_drivable(world), notes
    except ValueError as error:
        hint = "; `mapquilt worlds make --from-map` fills the others"
        mendable = is_world_file(name) and not plan.mended and "the free floor is in" in str(error)
        raise ValueError(f"{name}: {error}{hint if mendable else ''}") from error


def read_world(
    name: str,
    seed: int,
    width: float | None = None,
    height: float | None = None,
    plan: PlanOptions = PlanOptions(),
) -> tuple[World, tuple[str, ...]]:
    """Open a world as ``open_world`` does, without the check that robots can explore it."""
    if not name:
        raise ValueError("the name of the world is empty; `mapquilt worlds list` lists the families")
    path = Path(name)
    is_file = is_world_file(name)
    if is_file and not (width is None and height is None):
        raise ValueError(f"--width and --height: apply to families only; {name} has its own size")
    if plan.resolution is not None and path.suffix.lower() not in SCALED:
        raise ValueError(f"--plan-resolution: applies to pictures and drawings only, not to {name}")
    if is_file:
        return _read(path, plan)
    if name not in FAMILIES:
        raise ValueError(
            f"unknown world {name!r}; known are: {', '.join(FAMILIES)}, world files "
            "(JSON, YAML), and plans (pictures, map_server YAML, building.yaml, JSON, SVG, DXF, SDF)"
            f"{did_you_mean(name, FAMILIES)}"
        )
    if plan != PlanOptions():
        raise ValueError(f"--from-map and --level: apply to files only, not to the family {name}")
    return make_world(name, seed, width, height), ()


def is_world_file(name: str) -> bool:
    """Check if the name of a world is that of a file, whose world does not depend on a seed."""
    path = Path(name)
    return name not in FAMILIES and (path.suffix.lower() in (".json", *PICTURES, *DRAWINGS, *YAMLS) or path.exists())


def _read(path: Path, plan: PlanOptions) -> tuple[World, tuple[str, ...]]:
    ending = path.suffix.lower()
    if path.is_dir():
        raise ValueError(f"{path}: is a folder; name a world file or a plan")
    if ending in (*PICTURES, *DRAWINGS):
        return read_plan(path, None, plan)
    if ending not in (".json", *YAMLS):
        raise ValueError(
            f"{path}: is no world file (JSON, YAML) and no plan (a picture, map_server YAML, SVG, DXF, SDF)"
        )
    value = read_json(path) if ending == ".json" else read_yaml(path)
    if is_plan(value):
        return read_plan(path, value, plan)
    if not isinstance(value, dict):
        raise ValueError(f"{path}: is no world file: it holds no fields")
    if plan.level is not None:
        raise ValueError(f"--level: applies to buildings only, and {path} is none")
    check_record(path, "world", value)
    with reading(path):
        world = world_from_json(value, path.stem)
        return fill_pockets(world) if plan.mended else (world, ())
