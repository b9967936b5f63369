"""The maps that a merge takes, and where its folder keeps them, so that others can be added later."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import LoadedMap, load_map, require_known
from mapping.io.map_yaml import image_path, read_map_yaml
from mapping.io.safe_path import safe_path
from mapping.map_set import MapSet
from mapquilt.json_file import read_record
from mapquilt.merging.load_maps import load_map_files
from mapquilt.runs import folder as run_folder

INPUTS = "inputs"
"""Where a merge keeps copies of the map files that it was given."""


@dataclass(frozen=True, eq=False)
class MergeInputs:
    """A map set; for each map its ``files`` entry, relative to the merge's folder, and the grey that was read as
    unknown; and what is to be written for that, by relative path."""

    maps: MapSet
    files: tuple[str, ...]
    unknown: tuple[int | None, ...]
    copies: Mapping[str, bytes] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()


def run_inputs(run: Path) -> MergeInputs:
    """The maps of a run, which lie in it."""
    maps = run_folder.load_maps(run)
    record = read_record(run / run_folder.MAPS_FILE, "maps")
    return MergeInputs(maps, tuple(entry["file"] for entry in record["maps"]), (None,) * len(maps))


def file_inputs(paths: Sequence[Path], unknown: int | None) -> MergeInputs:
    """The user's own map files, to be copied."""
    maps, warnings = load_map_files(paths, unknown)
    files, copies = [], {}
    for index, path in enumerate(paths):
        kept = _copies(path, index)
        files.append(next(iter(kept)))
        copies.update(kept)
    return MergeInputs(maps, tuple(files), (unknown,) * len(paths), copies, warnings)


def added_inputs(folder: Path, paths: Sequence[Path], unknown: int | None) -> MergeInputs:
    """The maps of a merge that is there, a run's or one of map files, and others: one of a name that is there takes its
    place, as a map that has grown.

    Raises ``ValueError`` where there is no merge, or naming the file that cannot be used.
    """
    record = read_merge(folder)
    before = run_inputs(folder) if run_folder.is_run(folder) else None
    trusted = before is None or before.maps.resolutions_trusted
    maps: dict[str, LoadedMap] = {}
    files: dict[str, str] = {}
    greys: dict[str, int | None] = {}
    copies: dict[str, bytes] = {}
    for entry in record["maps"]:
        name, file = entry["name"], safe_path(folder, entry["file"])
        if file is None:
            raise ValueError(f"{folder / run_folder.MERGE_FILE}: file is {entry['file'][:100]!r}, outside the folder")
        maps[name] = load_map(file, unknown_grey=entry["unknown"])
        files[name], greys[name] = entry["file"], entry["unknown"]
    warnings = []
    for path in paths:
        loaded = require_known(load_map(path, unknown_grey=unknown))
        warnings += [f"{path}: {text}" for text in loaded.warnings]
        kept = _copies(path, _free_index(files.values()))
        maps[path.stem], files[path.stem], greys[path.stem] = loaded, next(iter(kept)), unknown
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
    """What tells a map from any other, its frame included."""
    return hashlib.sha256(repr(grid.frame).encode() + grid.log_odds.tobytes()).hexdigest()


def read_merge(folder: Path) -> dict[str, Any]:
    """The record of the merge in a folder. Raises ``ValueError`` naming the folder where there is none."""
    path = folder / run_folder.MERGE_FILE
    if not path.is_file():
        raise ValueError(f"{folder}: holds no merge to add to (it has no {run_folder.MERGE_FILE}); merge it first")
    return read_record(path, "merge")


def _copies(path: Path, index: int) -> dict[str, bytes]:
    """The files of a map as they are kept: the one that names it first."""
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
