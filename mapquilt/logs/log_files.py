"""Names of log files."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from pathlib import Path

from mapquilt.runs.folder import LOG_FILE

BAG_ENDINGS = (".bag", ".mcap", ".db3")
CARMEN_ENDINGS = (".log", ".clf", ".carmen", ".gz")
LOG_ENDINGS = (*BAG_ENDINGS, *CARMEN_ENDINGS, ".npz")
BAG_METADATA = "metadata.yaml"


def is_log(path: Path) -> bool:
    """Return whether a path names a log by its ending, or is the folder of a ROS 2 bag."""
    return path.suffix.lower() in LOG_ENDINGS or is_bag(path)


def is_bag(path: Path) -> bool:
    """Return whether a path names a bag by its ending, or is the folder of a ROS 2 bag."""
    return path.suffix.lower() in BAG_ENDINGS or (path / BAG_METADATA).is_file()


def log_name(path: Path) -> str:
    """Name a robot after its file, a ``log.npz`` after its folder: letters, digits and underscores, a letter first."""
    stem = path.resolve().name if path.name != LOG_FILE else path.resolve().parent.name
    while Path(stem).suffix.lower() in LOG_ENDINGS:
        stem = Path(stem).stem
    name = re.sub(r"[^A-Za-z0-9]+", "_", stem).strip("_")
    return name if name[:1].isalpha() and name.isascii() else f"log_{name}".rstrip("_")


def unique_names(names: Sequence[str]) -> tuple[str, ...]:
    """Number names that come again: the first keeps its name."""
    taken: dict[str, None] = {}
    for name in names:
        candidates = itertools.chain([name], (f"{name}_{number}" for number in itertools.count(1)))
        taken[next(one for one in candidates if one not in taken)] = None
    return tuple(taken)
