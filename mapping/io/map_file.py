"""Map files of ROS map_server: a YAML with a grey picture, or the picture alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import sealed
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import FREE, UNKNOWN, OccupancyGrid
from mapping.io.map_yaml import MapYaml, Mode, image_path, image_warnings, map_yaml_text, read_map_yaml
from mapping.io.occupancy_grey import (
    FREE_GREY,
    OCCUPIED_GREY,
    UNKNOWN_GREY,
    cell_of_grey,
    log_odds_of_cell,
    picture_of_grid,
    thresholds,
)
from mapping.io.picture import Picture, picture_bytes, read_picture
from mapping.io.transaction import finish_transaction, write_files_atomically
from mapping.map_set import Unit

SAVED_GREYS = frozenset((OCCUPIED_GREY, FREE_GREY, UNKNOWN_GREY))


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


UnknownGrey = int | Literal["none"] | None
"""Grey level (0 to 255) that means unknown, "none" for that of the thresholds alone, None for that of the file."""


def load_map(path: str | Path, *, unknown_grey: UnknownGrey = None) -> LoadedMap:
    """Load a map_server YAML with its picture, or a bare picture, cell for cell as nav2 does but for one case.

    The saver of ROS 2 writes a free_thresh of 0.25, under which its own grey of unknown, 205, reads as free. In a
    trinary picture with exactly the greys of the saver it is read as unknown, with a warning.

    A bare picture has resolution 1, origin 0, unit "cell" and map_server's default thresholds; a warning says so if a
    YAML of its name exists. Grey level ``unknown_grey`` is unknown whatever the thresholds are; with "none" they alone
    decide.

    Raises ``ValueError`` in one line naming the file, the field and the value for anything that is not such a map,
    and ``OSError`` if a file is missing or cannot be read.
    """
    path = Path(path)
    if isinstance(unknown_grey, int) and not 0 <= unknown_grey <= 255:
        raise ValueError(f"unknown_grey is {unknown_grey}, must be 0 to 255")
    finish_transaction(path.parent)
    if path.suffix.lower() not in (".yaml", ".yml"):
        return _loaded(path, MapYaml(image=path.name), read_picture(path), "cell", _yaml_beside(path), unknown_grey)
    meta, warnings = read_map_yaml(path)
    picture = _picture_of(path, meta)
    return _loaded(path, meta, picture, "m", (*warnings, *image_warnings(path, meta)), unknown_grey)


def _picture_of(path: Path, meta: MapYaml) -> Picture:
    image = image_path(path, meta)
    try:
        return read_picture(image)
    except FileNotFoundError:
        raise FileNotFoundError(f"{path}: image {meta.image}: no such file{_other_case(image)}") from None


def _other_case(image: Path) -> str:
    """Name the file whose name differs from that of a missing one by capital letters alone; empty if there is none."""
    folder = image.parent.iterdir() if image.parent.is_dir() else ()
    found = sorted(file.name for file in folder if file.name.lower() == image.name.lower())
    return f"; {found[0]} is there: correct the capitals in the YAML" if found else ""


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
    path: Path, meta: MapYaml, picture: Picture, unit: Unit, warnings: tuple[str, ...], unknown_grey: UnknownGrey
) -> LoadedMap:
    if picture.lossy:
        warnings = (*warnings, "the picture is a JPEG, whose greys are inexact; save maps as PGM or PNG")
    cells = cell_of_grey(meta)
    if isinstance(unknown_grey, int):
        cells[unknown_grey] = UNKNOWN
    if cells[UNKNOWN_GREY] == FREE:
        greys = _opaque_greys(picture)
        if unknown_grey is None and meta.mode == "trinary" and {UNKNOWN_GREY, FREE_GREY} <= greys <= SAVED_GREYS:
            cells[UNKNOWN_GREY] = UNKNOWN
            warnings = (*warnings, f"{_free_205(meta)}; it is read as unknown; --unknown none reads it as free")
        elif UNKNOWN_GREY in greys:
            warnings = (*warnings, f"{_free_205(meta)}; --unknown 205 reads it as unknown")
    return LoadedMap(_grid(picture, meta, cells), unit, path, warnings)


def _grid(picture: Picture, meta: MapYaml, cells: NDArray[np.int8]) -> OccupancyGrid:
    log_odds_of_grey = log_odds_of_cell(meta.mode)[cells + 1]
    opaque = picture.opaque if meta.mode != "raw" else None
    log_odds = np.zeros(picture.grey.shape, np.float32)
    for row in range(len(log_odds)):  # only known cells are written, so that the system gives unknown areas no memory
        seen = log_odds_of_grey[picture.grey[-1 - row]]
        if opaque is not None:
            seen[~opaque[-1 - row]] = 0.0
        np.copyto(log_odds[row], seen, where=seen != 0.0)
    rows, cols = picture.grey.shape
    return OccupancyGrid(GridFrame(meta.resolution, meta.origin, (rows, cols)), sealed(log_odds))


def _yaml_beside(path: Path) -> tuple[str, ...]:
    beside = path.with_suffix(".yaml")
    if not beside.exists():
        return ()
    return (f"read without resolution and origin; {beside.name} beside it may state them: name that instead",)


def _opaque_greys(picture: Picture) -> set[int]:
    opaque = picture.grey if picture.opaque is None else picture.grey[picture.opaque]
    return set(np.flatnonzero(np.bincount(opaque.ravel(), minlength=256)).tolist())


def _free_205(meta: MapYaml) -> str:
    return f"grey 205, which map savers write for unknown, is free by its free_thresh of {meta.free_thresh}"
