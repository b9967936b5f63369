"""Map files of ROS map_server: a YAML with a grey picture, or the picture alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import FREE, UNKNOWN, OccupancyGrid
from mapping.io.atomic import write_files_atomically
from mapping.io.map_yaml import MapYaml, Mode, image_path, map_yaml_text, read_map_yaml
from mapping.io.occupancy_grey import UNKNOWN_GREY, cell_of_grey, log_odds_of_cell, picture_of_grid, thresholds
from mapping.io.picture import Picture, picture_bytes, read_picture
from mapping.map_set import Unit


@dataclass(frozen=True, eq=False)
class LoadedMap:
    """A map from disk: its ``grid``, the ``unit`` of its coordinates, and the ``path`` it was loaded from.

    ``warnings`` are one line each, without the file's name.
    """

    grid: OccupancyGrid
    unit: Unit
    path: Path
    warnings: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the file without folder and extension."""
        return self.path.stem


def load_map(path: str | Path, *, unknown_grey: int | None = None) -> LoadedMap:
    """Load a map_server YAML with its picture, or a bare PGM or PNG, cell for cell as nav2 does.

    A bare picture has resolution 1, origin 0, unit "cell" and map_server's default thresholds; a warning says so if a
    YAML of its name exists. Grey level ``unknown_grey`` (0 to 255) is unknown whatever the thresholds are.

    Raises ``ValueError`` in one line naming the file, the field and the value for anything that is not such a map,
    and ``OSError`` if a file is missing or cannot be read.
    """
    path = Path(path)
    if unknown_grey is not None and not 0 <= unknown_grey <= 255:
        raise ValueError(f"unknown_grey is {unknown_grey}, must be 0 to 255")
    if path.suffix.lower() not in (".yaml", ".yml"):
        return _loaded(path, MapYaml(image=path.name), read_picture(path), "cell", _yaml_beside(path), unknown_grey)
    meta, warnings = read_map_yaml(path)
    return _loaded(path, meta, _picture_of(path, meta), "m", warnings, unknown_grey)


def _picture_of(path: Path, meta: MapYaml) -> Picture:
    image = image_path(path, meta)
    try:
        return read_picture(image)
    except FileNotFoundError:
        raise FileNotFoundError(f"{path}: image {meta.image}: no such file") from None


def require_known(loaded: LoadedMap) -> LoadedMap:
    """Return the map. Raises ``ValueError`` naming the file if every cell is unknown."""
    if not loaded.grid.known.any():
        raise ValueError(f"{loaded.path}: every cell of the map is unknown")
    return loaded


def save_map(
    grid: OccupancyGrid, stem: str | Path, *, mode: Mode = "trinary", picture: Literal["pgm", "png"] = "pgm"
) -> None:
    """Write ``STEM.pgm`` (or ``.png``) and ``STEM.yaml`` for ROS; equal grids give equal bytes.

    Trinary mode stores exactly ``occupancy()``; scale and raw store it in per cent. Resolution and origin keep every
    bit. Either both files are written or neither.

    Raises ``ValueError`` if the picture cannot store the mode (scale mode marks unknown by transparency, which a PGM
    does not have), and ``OSError`` if the folder is missing or cannot be written.
    """
    write_files_atomically(map_files(grid, Path(stem), mode=mode, picture=picture))


def map_files(
    grid: OccupancyGrid, stem: Path, *, mode: Mode = "trinary", picture: Literal["pgm", "png"] = "pgm"
) -> dict[Path, bytes]:
    """Return the two files of ``save_map`` as bytes."""
    occupied_thresh, free_thresh = thresholds(mode)
    meta = MapYaml(
        image=f"{stem.name}.{picture}",
        resolution=grid.frame.resolution,
        origin=grid.frame.origin,
        occupied_thresh=occupied_thresh,
        free_thresh=free_thresh,
        mode=mode,
    )
    return {
        stem.with_name(meta.image): picture_bytes(picture_of_grid(grid, mode), picture),
        stem.with_name(f"{stem.name}.yaml"): map_yaml_text(meta).encode(),
    }


def _loaded(
    path: Path, meta: MapYaml, picture: Picture, unit: Unit, warnings: tuple[str, ...], unknown_grey: int | None
) -> LoadedMap:
    cells = cell_of_grey(meta)
    if unknown_grey is not None:
        cells[unknown_grey] = UNKNOWN
    if cells[UNKNOWN_GREY] == FREE and _has_opaque(picture, UNKNOWN_GREY):
        warnings = (*warnings, _free_205_warning(meta))
    return LoadedMap(_grid(picture, meta, cells), unit, path, warnings)


def _grid(picture: Picture, meta: MapYaml, cells: NDArray[np.int8]) -> OccupancyGrid:
    log_odds = log_odds_of_cell(meta.mode)[cells + 1][picture.grey[::-1]]
    if picture.opaque is not None and meta.mode != "raw":
        log_odds[~picture.opaque[::-1]] = 0.0
    log_odds.flags.writeable = False
    rows, cols = picture.grey.shape
    return OccupancyGrid(GridFrame(meta.resolution, meta.origin, (rows, cols)), log_odds)


def _yaml_beside(path: Path) -> tuple[str, ...]:
    beside = path.with_suffix(".yaml")
    if not beside.exists():
        return ()
    return (f"read without resolution and origin; {beside.name} beside it may state them: name that instead",)


def _has_opaque(picture: Picture, grey: int) -> bool:
    found = picture.grey == grey
    return bool((found if picture.opaque is None else found & picture.opaque).any())


def _free_205_warning(meta: MapYaml) -> str:
    return (
        f"grey 205, which map savers write for unknown, reads as free with free_thresh {meta.free_thresh}; "
        "with --unknown 205 (unknown_grey=205) it stays unknown"
    )
