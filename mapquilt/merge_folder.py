"""What a merge leaves: merged.pgm, merged.yaml, merge.png and merge.json."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mapping.atomic import write_files_aside
from mapping.map_file import map_files
from mapping.map_set import MapSet
from mapquilt import run_folder
from mapquilt.json_file import record_bytes
from mapquilt.merge_file import merge_record
from mapquilt.png import figure_png
from mapquilt.spare_maps import spare_maps
from merge.result import MergeResult
from merge.settings import MergeSettings


def refuse_merge(folder: Path, sources: Sequence[Path]) -> None:
    """Raise ``ValueError`` where writing a merge of the maps ``sources`` there would overwrite one of them, a run, or
    what mapquilt did not write."""
    if run_folder.is_run(folder):
        raise ValueError(f"{folder}: is a run, whose maps `mapquilt merge {folder}` merges; name another folder")
    merged = folder / run_folder.MERGED_NAME
    spare_maps(folder, sources, (merged.with_suffix(".yaml"), merged.with_suffix(".pgm")))
    run_folder.refuse_foreign(folder, run_folder.MERGE_FILE)


def merge_files(
    folder: Path, maps: MapSet, settings: MergeSettings, seed: int, result: MergeResult
) -> dict[Path, bytes]:
    """The files of a merge in that folder, as bytes."""
    from mapquilt.overview import merge_figure

    path = folder / run_folder.MERGE_FILE
    record = record_bytes(path, "merge", merge_record(maps, settings, seed, result))
    picture = figure_png(merge_figure(maps, result.merged, dict(result.reference_from_map)))
    merged = map_files(result.merged, folder / run_folder.MERGED_NAME)
    return {**merged, folder / run_folder.MERGE_PICTURE: picture, path: record}


def write_merge(folder: Path, maps: MapSet, settings: MergeSettings, seed: int, result: MergeResult) -> None:
    """Write all files of a merge, or none, into a folder, which is made if it is missing."""
    files = merge_files(folder, maps, settings, seed, result)
    folder.mkdir(parents=True, exist_ok=True)
    write_files_aside(files)
