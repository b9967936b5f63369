"""Input maps of a merge, and their copies in its folder, so that maps can be added later."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import LoadedMap, UnknownGrey, load_map, require_known
from mapping.io.map_yaml import image_path, read_map_yaml
from mapping.io.safe_path import safe_path
from mapping.map_set import MapSet
from mapquilt.json_file import read_record
from mapquilt.merging.load_maps import load_map_files, map_warnings
from mapquilt.merging.map_names import known_name, map_names
from mapquilt.runs import folder as run_folder

INPUTS = "inputs"
"""Folder of the copies of the given map files."""


@dataclass(frozen=True, eq=False)
class MergeInputs:
    """Hold a map set; for each map its file, relative to the merge's folder, and the grey level that was read as
    unknown; and the files to write for them, by relative path. ``notes`` say how maps of logs were made."""

    maps: MapSet
    files: tuple[str, ...]
    unknown: tuple[UnknownGrey, ...]
    copies: Mapping[str, bytes] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def run_inputs(run: Path) -> MergeInputs:
    """Load the maps of a run, which need no copies."""
    maps = run_folder.load_maps(run)
    record = read_record(run / run_folder.MAPS_FILE, "maps")
    return MergeInputs(maps, tuple(entry["file"] for entry in record["maps"]), (None,) * len(maps))


def file_inputs(paths: Sequence[Path], unknown: UnknownGrey) -> MergeInputs:
    """Load map files of the user, and copy them."""
    maps, warnings = load_map_files(paths, unknown)
    files, copies = [], {}
    for index, path in enumerate(paths):
        kept = _copies(path, index)
        files.append(next(iter(kept)))
        copies.update(kept)
    return MergeInputs(maps, tuple(files), (unknown,) * len(paths), copies, warnings)


def added_inputs(folder: Path, paths: Sequence[Path], unknown: UnknownGrey) -> MergeInputs:
    """Load the maps of an existing merge and further ones, of which those with a known name replace the older map.

    Raises ``ValueError`` if there is no merge, or naming the file that cannot be used.
    """
    record = read_merge(folder)
    before = run_inputs(folder) if run_folder.is_run(folder) else None
    trusted = before is None or before.maps.resolutions_trusted
    maps: dict[str, LoadedMap] = {}
    files: dict[str, str] = {}
    greys: dict[str, UnknownGrey] = {}
    copies: dict[str, bytes] = {}
    for entry in record["maps"]:
        name, file = entry["name"], safe_path(folder, entry["file"])
        if file is None:
            raise ValueError(
                f"{folder / run_folder.MERGE_FILE}: file is {entry['file'][:100]!r}, must lie inside the folder"
            )
        maps[name] = load_map(file, unknown_grey=entry["unknown"])
        files[name], greys[name] = entry["file"], entry["unknown"]
    warnings: list[str] = []
    known = tuple(maps)
    for path, own_name in zip(paths, map_names(paths), strict=True):
        loaded = require_known(load_map(path, unknown_grey=unknown))
        warnings += map_warnings(path, loaded)
        name = known_name(path, known) or own_name
        if name in known:
            warnings.append(f"{path}: replaces the map {name} of the merge")
        kept = _copies(path, _free_index(files.values()))
        maps[name], files[name], greys[name] = loaded, next(iter(kept)), unknown
        copies.update(kept)
    merged = MapSet(
        names=tuple(maps),
        grids=tuple(each.grid for each in maps.values()),
        units=tuple(each.unit for each in maps.values()),
        resolutions_trusted=trusted,
        provenance={"source": "files"} if before is None else before.maps.provenance,
    )
    return MergeInputs(merged, tuple(files.values()), tuple(greys.values()), copies, tuple(warnings))


def map_fingerprint(grid: OccupancyGrid) -> str:
    """Hash the cells and the frame of a map."""
    digest = hashlib.sha256(repr(grid.frame).encode())
    digest.update(np.ascontiguousarray(grid.log_odds).data)
    return digest.hexdigest()


def read_merge(folder: Path) -> dict[str, Any]:
    """Read the merge.json of a folder. Raises ``ValueError`` naming the folder if there is none."""
    path = folder / run_folder.MERGE_FILE
    if not path.is_file():
        raise ValueError(f"{folder}: holds no merge to add to (it has no {run_folder.MERGE_FILE}); merge it first")
    return read_record(path, "merge")


def _copies(path: Path, index: int) -> dict[str, bytes]:
    """Read the files of a map to be copied, the one that the user named first."""
    place = f"{INPUTS}/{index}"
    kept = {f"{place}/{path.name}": path.read_bytes()}
    if path.suffix.lower() in (".yaml", ".yml"):
        image = image_path(path, read_map_yaml(path)[0])
        relative = Path(os.path.relpath(image.absolute(), path.parent.absolute())).as_posix()
        kept[f"{place}/{relative}"] = image.read_bytes()
    return kept


def _free_index(files: Iterable[str]) -> int:
    taken = [int(parts[1]) for parts in (Path(file).parts for file in files) if parts[0] == INPUTS]
    return max(taken, default=-1) + 1
