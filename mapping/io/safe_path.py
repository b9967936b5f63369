"""Files that must lie in a folder, whoever names them."""

from __future__ import annotations

import os
from pathlib import Path


def within(folder: Path, name: str) -> Path | None:
    """The file that ``name`` means in ``folder``, or None where it would lie outside.

    A file from a stranger must not make the program open others. An absolute name into the folder is fine.
    """
    base = Path(os.path.normpath(folder.absolute()))
    file = Path(os.path.normpath(base / name))
    if "\0" in name or not file.is_relative_to(base):
        return None
    return folder / file.relative_to(base)
