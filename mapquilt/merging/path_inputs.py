"""Inputs of a merge by their paths: map files, and logs, which are mapped first."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from mapping.io.map_file import UnknownGrey, save_map
from mapping.settings import MappingSettings
from mapquilt.logs.log_files import is_log, log_name, unique_names
from mapquilt.merging.merge_inputs import MergeInputs, file_inputs


def path_inputs(
    paths: Sequence[Path], unknown: UnknownGrey, on_progress: Callable[[int, int], None] | None = None
) -> MergeInputs:
    """Load map files, and map logs with default settings, as ``mapquilt map`` does.

    ``unknown`` is the grey level of map files that means unknown. ``on_progress`` gets the number of logs mapped and
    their total. Raises ``ValueError`` or ``OSError`` naming the file that cannot be used, ``ImportError`` if a bag
    needs rosbags.
    """
    logs = [path for path in paths if is_log(path)]
    if not logs:
        return file_inputs(paths, unknown)
    if len(paths) == 1:
        raise ValueError(f"{paths[0]}: gives one map; cut it with `mapquilt map --parts`, or name a second log or map")
    for first, second in itertools.combinations(logs, 2):
        if first == second or (first.exists() and second.exists() and first.samefile(second)):
            raise ValueError(f"{first} and {second} are one log; a map is not merged with itself")
    names = unique_names([log_name(path) if is_log(path) else path.stem for path in paths])
    files, warnings = [], []
    with TemporaryDirectory(prefix="mapquilt-") as folder:
        for path, name in zip(paths, names, strict=True):
            if not is_log(path):
                files.append(path)
                continue
            files.append(Path(folder) / f"{name}.yaml")
            warnings += [f"{path}: {text}" for text in _draw(path, files[-1].with_suffix(""))]
            if on_progress is not None:
                on_progress(sum(map(is_log, paths[: len(files)])), len(logs))
        inputs = file_inputs(files, unknown)
    return replace(inputs, warnings=(*warnings, *inputs.warnings))


def _draw(path: Path, stem: Path) -> tuple[str, ...]:
    """Write the map of a log, and return the warnings of reading it."""
    from mapquilt.logs.load_log import LogSource, load_log  # here: they load the simulator, which map files do not need
    from mapquilt.logs.log_map import draw_log

    (log,) = load_log(path, LogSource())
    save_map(draw_log(log, MappingSettings()).grid, stem)
    return log.recorded.warnings
