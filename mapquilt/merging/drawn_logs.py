"""Logs among the maps to merge: each is mapped first."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from mapping.io.map_file import save_map
from mapping.settings import MappingSettings
from mapquilt.logs.load_log import LogSource, load_log
from mapquilt.logs.log_files import is_log, log_name, unique_names
from mapquilt.logs.log_map import draw_log


@contextmanager
def drawn_logs(
    paths: Sequence[Path], on_progress: Callable[[int, int], None] | None = None
) -> Iterator[tuple[list[Path], tuple[str, ...]]]:
    """Map the logs among the paths with default settings, as ``mapquilt map`` does.

    Yields the paths with map files in place of logs, which are deleted after the block, and the warnings of the logs.
    ``on_progress`` gets the number of logs done and their total. Raises ``ValueError`` or ``OSError`` naming the log
    that cannot be mapped, ``ImportError`` if a bag needs rosbags.
    """
    for first, second in itertools.combinations([path for path in paths if is_log(path)], 2):
        if first == second or (first.exists() and second.exists() and first.samefile(second)):
            raise ValueError(f"{first} and {second} are one log; a map is not merged with itself")
    names = unique_names([log_name(path) if is_log(path) else path.stem for path in paths])
    total, done = sum(map(is_log, paths)), 0
    files, warnings = [], []
    with TemporaryDirectory(prefix="mapquilt-") as folder:
        for path, name in zip(paths, names, strict=True):
            if not is_log(path):
                files.append(path)
                continue
            (log,) = load_log(path, LogSource())
            warnings += [f"{path}: {text}" for text in log.recorded.warnings]
            save_map(draw_log(log, MappingSettings()).grid, Path(folder) / name)
            files.append(Path(folder) / f"{name}.yaml")
            done += 1
            if on_progress is not None:
                on_progress(done, total)
        yield files, tuple(warnings)
