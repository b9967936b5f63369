"""Inputs of a merge by their paths: map files, and logs, which are mapped first."""

from __future__ import annotations

import filecmp
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import UnknownGrey, save_map
from mapping.settings import MappingSettings
from mapping.wording import counted
from mapquilt.logs.log_files import is_log, log_name, unique_names
from mapquilt.merging.load_maps import load_map_files
from mapquilt.merging.merge_inputs import MergeInputs, file_inputs
from merge.settings import MergeSettings

if TYPE_CHECKING:
    from mapquilt.logs.load_log import NamedLog


def path_inputs(
    paths: Sequence[Path],
    unknown: UnknownGrey,
    on_progress: Callable[[int, int], None] = lambda _, __: None,
    settings: MergeSettings = MergeSettings(),
    seed: int = 0,
) -> MergeInputs:
    """Load map files, and map logs with default settings, as ``mapquilt map`` does.

    An elastic merge by ``settings`` optimises the poses of several logs together (``draw_jointly``). ``unknown`` is the
    grey level of map files that means unknown. ``on_progress`` gets the number of logs mapped and their total. Raises
    ``ValueError`` or ``OSError`` naming the file that cannot be used, ``ImportError`` if a bag needs rosbags.
    """
    logs = [path for path in paths if is_log(path)]
    if not logs:
        return file_inputs(paths, unknown)
    if len(paths) == 1:
        raise ValueError(f"{paths[0]}: gives one map; cut it with `mapquilt map --parts`, or name a second log or map")
    for first, second in itertools.combinations(logs, 2):
        if first == second or (first.exists() and second.exists() and _is_same(first, second)):
            raise ValueError(f"{first} and {second} are one log; a map is not merged with itself")
    maps = [path for path in paths if path not in logs]
    if maps:
        load_map_files(maps, unknown)  # before the logs are mapped, which takes longer
    names = unique_names([log_name(path) if is_log(path) else path.stem for path in paths])
    named = {path: name for path, name in zip(paths, names, strict=True) if is_log(path)}
    together = settings.elastic and len(named) > 1
    drawn, notes, warnings = (_drawn_together if together else _drawn)(named, settings, seed, on_progress)
    with TemporaryDirectory(prefix="mapquilt-") as folder:
        for path, grid in drawn.items():
            save_map(grid, Path(folder) / named[path])
        files = [Path(folder) / f"{named[path]}.yaml" if path in named else path for path in paths]
        inputs = file_inputs(files, unknown)
    return replace(inputs, warnings=(*warnings, *inputs.warnings), notes=notes)


def _is_same(first: Path, second: Path) -> bool:
    """Return True if two paths are one log, or files of the same bytes."""
    return first.samefile(second) or (
        first.is_file() and second.is_file() and filecmp.cmp(first, second, shallow=False)
    )


Drawn = tuple[dict[Path, OccupancyGrid], tuple[str, ...], tuple[str, ...]]
"""Maps of logs, notes on how they were made, and warnings of reading them."""


def _drawn(named: Mapping[Path, str], _: MergeSettings, __: int, on_progress: Callable[[int, int], None]) -> Drawn:
    """Map each log by itself."""
    from mapquilt.logs.log_map import draw_log  # here: it loads the simulator, which map files do not need

    grids, warnings = {}, []
    for path in named:
        log = _load(path, named[path])
        warnings += [f"{path}: {text}" for text in log.recorded.warnings]
        grids[path] = draw_log(log, MappingSettings()).grid
        on_progress(len(grids), len(named))
    return grids, (), tuple(warnings)


def _drawn_together(
    named: Mapping[Path, str], settings: MergeSettings, seed: int, on_progress: Callable[[int, int], None]
) -> Drawn:
    """Map logs at poses that are optimised together."""
    from mapquilt.merging.joint_maps import draw_jointly

    logs = [_load(path, name) for path, name in named.items()]
    warnings = [f"{path}: {text}" for path, log in zip(named, logs, strict=True) for text in log.recorded.warnings]
    joint = draw_jointly(logs, MappingSettings(), settings, seed, on_progress)
    notes = [
        f"{first} and {second}: poses optimised together, by {counted(number, 'loop')} between them"
        for (first, second), number in joint.loops.items()
    ] or ["no poses were optimised together: no loop links two of the logs"]
    return {path: joint.grids[name] for path, name in named.items()}, tuple(notes), tuple(warnings)


def _load(path: Path, name: str) -> NamedLog:
    from mapquilt.logs.load_log import LogSource, load_log

    (log,) = load_log(path, LogSource())
    return replace(log, name=name)
