"""Files of a merge: a merged map and its conflicts for each group, transforms.yaml, merge.png and merge.json."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path, PurePosixPath
from types import MappingProxyType

from mapping.io.map_file import map_files
from mapping.io.safe_load import printable
from mapping.io.transaction import change_files, written_files
from mapping.map_set import Unit
from mapquilt.json_file import record_bytes
from mapquilt.merging.merge_file import group_stems, has_files, merge_record
from mapquilt.merging.merge_inputs import INPUTS, MergeInputs, run_inputs
from mapquilt.merging.remedies import mirrored_fit, remedy
from mapquilt.merging.spare_maps import spare_maps
from mapquilt.merging.transforms_file import transforms_text
from mapquilt.runs import folder as run_folder
from mapquilt.viz.png import figure_png
from merge.merger import Progress, merge_maps
from merge.pair.task import Runner
from merge.records.result import MergeResult, PairResult
from merge.settings import MergeSettings

_NOT_ALWAYS = (
    run_folder.REFUSED_PICTURE,
    run_folder.ELASTIC_PICTURE,
    run_folder.ALIGN_FILE,
    f"{run_folder.YAW_ZERO_NAME}.yaml",
    f"{run_folder.YAW_ZERO_NAME}.pgm",
    f"{run_folder.IN_FRAME_NAME}.yaml",
    f"{run_folder.IN_FRAME_NAME}.pgm",
)
"""Files that only some merges have."""


def refuse_merge(folder: Path, sources: Sequence[Path]) -> None:
    """Raise ``ValueError`` if writing a merge of ``sources`` to the folder would overwrite one of them, a run, or
    files that mapquilt did not write."""
    if run_folder.is_run(folder):
        raise ValueError(f"{folder}: is a run, whose maps `mapquilt merge {folder}` merges; choose another folder")
    written = [
        path for path in folder.glob("*") if path.suffix in (".yaml", ".pgm") and run_folder.is_answer(path.name)
    ]
    copies = folder / INPUTS
    kept = [] if copies.is_symlink() else [path for path in copies.rglob("*") if path.is_file()]
    spare_maps(folder, sources, [*written, *kept])
    run_folder.refuse_foreign(folder, run_folder.MERGE_FILE)


def merge_files(
    folder: Path, inputs: MergeInputs, settings: MergeSettings, seed: int, result: MergeResult
) -> dict[Path, bytes]:
    """Build the files of a merge by path, as bytes."""
    from mapquilt.viz.elastic_picture import elastic_figure
    from mapquilt.viz.merge_picture import merge_figure
    from mapquilt.viz.refused_picture import pairs_to_show, refused_figure

    path = folder / run_folder.MERGE_FILE
    record = record_bytes(path, "merge", merge_record(inputs, settings, seed, result))
    files = {folder / name: data for name, data in inputs.copies.items()}
    for index, group in enumerate(result.groups):
        if has_files(group, index):
            merged, conflicts = group_stems(index)
            unit = inputs.maps.units[inputs.maps.names.index(group.reference)]
            for grid, stem in ((group.merged, merged), (group.conflicts, conflicts)):
                files |= with_unit(map_files(grid, folder / stem), unit, group.reference)
    files[folder / run_folder.TRANSFORMS_FILE] = transforms_text(inputs.maps, result).encode()
    files[folder / run_folder.MERGE_PICTURE] = figure_png(merge_figure(inputs.maps, result.groups))
    if any(group.bends for group in result.groups):
        files[folder / run_folder.ELASTIC_PICTURE] = figure_png(elastic_figure(inputs.maps, result.groups))
    refused = pairs_to_show(result)
    if refused:
        remedies = [remedy(pair, inputs.maps, settings) for pair in refused]
        mirrored = [mirrored_fit(pair, inputs.maps, settings, seed) for pair in refused]
        files[folder / run_folder.REFUSED_PICTURE] = figure_png(
            refused_figure(inputs.maps, refused, remedies, mirrored)
        )
    return {**files, path: record}


def with_unit(files: dict[Path, bytes], unit: Unit, reference: str) -> dict[Path, bytes]:
    """Say in the YAML of a map in cells that its resolution of 1 is no metre."""
    if unit == "m":
        return files
    name = printable(reference)
    note = f"# {name} states no resolution: lengths are in its cells, and 1.0 is no size in metres.\n".encode()
    return {path: note + data if path.suffix == ".yaml" else data for path, data in files.items()}


def write_merge(
    folder: Path,
    inputs: MergeInputs,
    settings: MergeSettings,
    seed: int,
    result: MergeResult,
    further: Mapping[Path, bytes] = MappingProxyType({}),
) -> tuple[Path, ...]:
    """Write all files of a merge and ``further`` ones, or none, into a folder, which is created if it is missing.

    Returns their paths.
    """
    return _write_answer(folder, inputs, {**merge_files(folder, inputs, settings, seed, result), **further})


def _write_answer(
    folder: Path, inputs: MergeInputs, files: dict[Path, bytes], stale: Collection[str] = ()
) -> tuple[Path, ...]:
    """Write the files of a merge and delete the ``stale`` ones and those that only an older merge had, all or none."""
    folder.mkdir(parents=True, exist_ok=True)
    change_files(folder, files, {*_left(folder, inputs.files), *stale}, ledger=True)
    return tuple(files)


def _left(folder: Path, kept: Iterable[str]) -> list[str]:
    """List the files of older merges of which a merge has not always the same: of groups, and copies of inputs."""
    places = {PurePosixPath(file).parent for file in kept}
    return [
        name
        for name in written_files(folder)
        if run_folder.OF_A_GROUP.fullmatch(name)
        or name in _NOT_ALWAYS
        or (name.startswith(f"{INPUTS}/") and places.isdisjoint(PurePosixPath(name).parents))
    ]


def merge_run(
    run: Path,
    settings: MergeSettings,
    seed: int,
    on_progress: Progress | None = None,
    inputs: MergeInputs | None = None,
    runner: Runner | None = None,
    answers: Mapping[tuple[str, str], PairResult] | None = None,
    may_write: Callable[[MergeResult], bool] = lambda _: True,
    further: Mapping[Path, bytes] = MappingProxyType({}),
) -> tuple[MergeResult, tuple[Path, ...]]:
    """Merge a run's maps, from the map files alone, and write all files of the merge, and ``further`` ones, or none.

    Returns the result and the paths of the files.

    ``inputs`` replace the run's own maps; ``answers`` are pairs that are known already. Nothing is written unless
    ``may_write`` says so of the result. The score of an older merge is deleted. Raises ``ValueError`` if another run
    has replaced the folder meanwhile.
    """
    made_by = (run_folder.require_run(run) / run_folder.RUN_FILE).read_bytes()
    inputs, timings = inputs or run_inputs(run), run_folder.read_timings(run)
    start = time.perf_counter()
    result = merge_maps(inputs.maps, settings, seed, on_progress, runner, answers)
    if not may_write(result):
        return result, ()
    merged = time.perf_counter() - start
    files = merge_files(run, inputs, settings, seed, result)
    seconds = {"merge": merged, "draw": time.perf_counter() - start - merged}
    if (run / run_folder.RUN_FILE).read_bytes() != made_by:
        raise ValueError(f"{run}: was replaced by another run during the merge; merge again")
    files |= {**run_folder.timings_file(run, timings, "merge", seconds), **further}
    stale = (run_folder.SCORE_FILE, run_folder.OVERVIEW_PICTURE)
    return result, _write_answer(run, inputs, files, stale)
