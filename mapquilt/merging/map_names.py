"""Names of maps after their files."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from pathlib import Path


def map_names(paths: Sequence[Path]) -> tuple[str, ...]:
    """Name each map by the shortest end of its path that no other path has, without the extension.

    ``a/map.yaml`` and ``b/map.yaml`` are ``a/map`` and ``b/map``; files that differ by the extension alone keep it.
    """
    ends = [_ends(path) for path in paths]
    seen = Counter(end for each in ends for end in each)
    return tuple(next((end for end in each if seen[end] == 1), each[-1]) for each in ends)


def known_name(path: Path, known: Sequence[str]) -> str | None:
    """Return the longest of the known names that is an end of the path, None if none is."""
    return next((end for end in reversed(_ends(path)) if end in known), None)


def _ends(path: Path) -> list[str]:
    """List the ends of a path, shortest first: without the extension, then with it."""
    *folders, file = Path(os.path.normpath(path.absolute())).parts[1:]
    starts = ["/".join((*folders[len(folders) - length :], "")) for length in range(len(folders) + 1)]
    starts = [start.removeprefix("/") for start in starts]
    stem = Path(file).stem
    return [*(f"{start}{stem}" for start in starts), *(f"{start}{file}" for start in starts)]
