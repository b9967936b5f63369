"""Paths from untrusted files, confined to a folder."""

from __future__ import annotations

import os
from pathlib import Path


def safe_path(folder: Path, name: str) -> Path | None:
    """Resolve ``name`` in ``folder``; None if it is outside.

    A file from a stranger must not make the program open other files, through a link either. An absolute name into the
    folder is allowed.
    """
    base = Path(os.path.normpath(folder.absolute()))
    file = Path(os.path.normpath(base / name))
    if "\0" in name or not file.is_relative_to(base):
        return None
    if not Path(os.path.realpath(file)).is_relative_to(os.path.realpath(base)):
        return None
    return folder / file.relative_to(base)
