"""Map files of the user as a map set."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mapping.io.map_file import LoadedMap, UnknownGrey, load_map, require_known
from mapping.map_set import MapSet
from mapquilt.merging.map_names import map_names


def load_map_files(paths: Sequence[Path], unknown_grey: UnknownGrey = None) -> tuple[MapSet, tuple[str, ...]]:
    """Load map files (map_server YAML, or bare pictures) and return them with the warnings of reading.

    A map is named by the shortest end of its path that no other has (``map_names``). ``unknown_grey`` is that
    of ``load_map``.

    Raises ``ValueError`` or ``OSError`` naming every file that cannot be used, or one that is given twice, and if there
    is only one.
    """
    if len(paths) < 2 and not paths[0].exists():
        raise ValueError(f"{paths[0]}: no such file or folder")
    if len(paths) < 2:
        raise ValueError(f"{paths[0]}: one map cannot be merged; give at least two, or a run folder")
    for path in paths:
        if path.is_dir():
            raise ValueError(f"{path}: is a folder; give map files, or one run folder")
    loaded = _load_all(paths, unknown_grey)
    for path, entry in zip(paths, loaded, strict=True):
        if np.unique(entry.grid.occupancy()).size == 1:
            says = "occupied" if entry.grid.occupied.any() else "free"
            raise ValueError(f"{path}: every cell of the map is {says}, so nothing can be matched")
    for first, second in itertools.combinations(paths, 2):
        if first == second:
            raise ValueError(f"{first}: is given twice; a map cannot be merged with itself")
        if first.samefile(second):
            raise ValueError(f"{first} and {second} are the same file; a map cannot be merged with itself")
    warnings = tuple(text for path, entry in zip(paths, loaded, strict=True) for text in map_warnings(path, entry))
    maps = MapSet(
        names=map_names(paths),
        grids=tuple(entry.grid for entry in loaded),
        units=tuple(entry.unit for entry in loaded),
        provenance={"source": "files"},
    )
    return maps, warnings


def map_warnings(path: Path, loaded: LoadedMap) -> tuple[str, ...]:
    """Return the warnings of reading a map, and that its resolution is unknown, each with the file."""
    no_resolution = "states no resolution, so its lengths are in cells; a map_server YAML that names it states one"
    texts = (*loaded.warnings, *((no_resolution,) if loaded.unit == "cell" else ()))
    return tuple(f"{path}: {text}" for text in texts)


def _load_all(paths: Sequence[Path], unknown_grey: UnknownGrey) -> list[LoadedMap]:
    """Load all maps, or report all that cannot be loaded."""
    loaded, faults = [], []
    for path in paths:
        try:
            loaded.append(require_known(load_map(path, unknown_grey=unknown_grey)))
        except (ValueError, OSError) as error:
            faults.append(error)
    if len(faults) == 1:
        raise faults[0]
    if faults:
        raise ValueError("; ".join(_text(fault) for fault in faults))
    return loaded


def _text(fault: ValueError | OSError) -> str:
    known = isinstance(fault, OSError) and fault.filename is not None
    return f"{fault.filename}: {fault.strerror}" if known else str(fault)  # type: ignore[union-attr]
