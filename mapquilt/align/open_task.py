"""Maps to align by the paths that a person names: map files, a run, or the folder of a merge."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from mapping.geometry.scale_range import ScaleRange
from mapping.io.map_file import UnknownGrey
from mapping.map_set import MapSet
from mapquilt.align.arrangement import Arrangement, Placement, start_arrangement
from mapquilt.align.workspace import AlignTask, Pair
from mapquilt.json_file import similarity_from_record
from mapquilt.merging.map_names import map_names
from mapquilt.merging.merge_again import answers_before, settings_before
from mapquilt.merging.merge_folder import refuse_merge
from mapquilt.merging.merge_inputs import added_inputs, read_merge, run_inputs
from mapquilt.merging.path_inputs import path_inputs
from mapquilt.runs import folder as run_folder
from merge.records.result import PairResult
from merge.settings import MergeSettings


def open_task(
    paths: Sequence[Path],
    out: Path | None = None,
    unknown: UnknownGrey = None,
    scale: ScaleRange | None = None,
    seed: int = 0,
    on_progress: Callable[[int, int], None] = lambda _, __: None,
) -> AlignTask:
    """Open maps to align. A run or a merge keeps its answer in its own folder, and shows the one that it has.

    ``on_progress`` gets the number of logs mapped and their total.

    Raises ``ValueError`` or ``OSError`` naming the file or option that cannot be used.
    """
    if len(paths) > 1 or not paths[0].is_dir():
        folder = Path("aligned") if out is None else out
        inputs = path_inputs(paths, unknown, on_progress)
        refuse_merge(folder, paths)
        return AlignTask(inputs, MergeSettings(scale=scale), seed, folder, tuple(map(str, paths)))
    (folder,) = paths
    for option, value in (("--out", out), ("--unknown", unknown), ("--scale", scale)):
        if value is not None:
            raise ValueError(f"{option}: applies to map files only; {folder} keeps its settings and its answer")
    if not (folder / run_folder.MERGE_FILE).is_file():
        return AlignTask(run_inputs(folder), MergeSettings(), seed, folder, (str(folder),))
    return _of_merge(folder)


def _of_merge(folder: Path) -> AlignTask:
    """Open the maps, settings and answers of a merge."""
    record, inputs = read_merge(folder), added_inputs(folder, (), None)
    maps = inputs.maps
    settings = settings_before(record, maps.resolutions_trusted)
    known = _by_index(answers_before(folder, maps, settings, record["seed"]), maps)
    sources: tuple[str, ...] = (str(folder),)
    names = None
    if not run_folder.is_run(folder):
        files = [folder / file for file in inputs.files]
        sources, names = tuple(map(str, files)), map_names(files)
    plain = replace(settings, priors=(), reference=None, trust_priors=False)
    return AlignTask(inputs, plain, record["seed"], folder, sources, known, _arrangement(record, maps), names)


def _by_index(answers: Any, maps: MapSet) -> dict[Pair, PairResult]:
    return {
        (maps.names.index(target), maps.names.index(source)): answer for (target, source), answer in answers.items()
    }


def _arrangement(record: dict[str, Any], maps: MapSet) -> Arrangement:
    """Lay the maps that a merge joined as it did, and the others in the middle."""
    reference = maps.names.index(record["reference"])
    start = start_arrangement(maps).with_reference(reference)
    sheet = start.placements[reference].sheet_from_map
    for index, entry in enumerate(record["maps"]):
        pose = entry["reference_from_map"]
        if pose is not None:
            start = start.placed(index, Placement(sheet @ similarity_from_record(pose), "automatic"))
    return start
