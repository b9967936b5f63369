"""Conversion of one map file to another."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.atomic import write_bytes_atomically
from mapping.io.map_file import UnknownGrey, load_map, save_map
from mapping.io.map_yaml import Mode
from mapping.io.occupancy_grey import picture_of_grid
from mapping.io.picture import picture_bytes
from mapping.map_set import Unit
from mapquilt.convert.reframing import Reframing
from mapquilt.merging.spare_maps import spare_maps

PictureKind = Literal["pgm", "png"]


@dataclass(frozen=True)
class MapConversion:
    """Hold the files that were written, the raster of the map and its unit, and the warnings of reading."""

    written: tuple[Path, ...]
    frame: GridFrame
    unit: Unit
    warnings: tuple[str, ...]


def convert_map(
    source: Path, out: Path, mode: Mode, unknown_grey: UnknownGrey, reframing: Reframing = Reframing()
) -> MapConversion:
    """Write the map at ``source`` to ``out``, which ends in .yaml, .pgm or .png, in a folder that is made if missing.

    YAML and picture are written under one name; a ``.yaml`` gets a PGM, or in scale mode a PNG. Resolution, origin and
    yaw are exact, unless ``reframing`` changes them. A picture without YAML has no resolution, so only a picture is
    written. A link is followed.

    Raises ``ValueError`` or ``OSError`` naming a file that cannot be read, is not a map, or would replace the source.
    """
    if out.is_symlink():
        out = Path(os.path.realpath(out))  # so that YAML and picture have the same folder
    kind = _picture_kind(out, mode)
    loaded = load_map(source, unknown_grey=unknown_grey)
    written: tuple[Path, ...] = (out.with_suffix(".yaml"), out.with_suffix(f".{kind}"))
    spare_maps(out, (source,), written)
    if loaded.unit == "cell" and (reframing.yaw is not None or reframing.resolution is not None):
        raise ValueError(f"{source}: a picture without YAML has neither resolution nor yaw to change")
    grid = reframing.apply(loaded.grid)
    if loaded.unit == "cell":
        written = (out,)
        _save_bare(source, grid, out, mode, kind)
    else:
        out.parent.mkdir(parents=True, exist_ok=True)
        save_map(grid, out.with_suffix(""), mode=mode, picture=kind)
    warnings = tuple(f"{source}: {warning}" for warning in loaded.warnings)
    return MapConversion(written, grid.frame, loaded.unit, warnings)


def _picture_kind(out: Path, mode: Mode) -> PictureKind:
    if out.suffix == ".yaml":
        return "png" if mode == "scale" else "pgm"
    if out.suffix not in (".pgm", ".png"):
        raise ValueError(f"{out}: a map must end in .yaml, .pgm or .png")
    if out.suffix == ".pgm" and mode == "scale":
        raise ValueError(f"{out}: a PGM cannot mark unknown cells in scale mode; write a .png")
    return "png" if out.suffix == ".png" else "pgm"


def _save_bare(source: Path, grid: OccupancyGrid, out: Path, mode: Mode, kind: PictureKind) -> None:
    if out.suffix == ".yaml":
        raise ValueError(f"{source}: a picture without YAML has no resolution; write a .pgm or .png")
    if mode != "trinary":
        raise ValueError(f"{source}: mode {mode} needs a YAML, which a bare picture lacks")
    out.parent.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(out, picture_bytes(picture_of_grid(grid, mode), kind))
