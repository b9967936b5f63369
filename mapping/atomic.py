"""Files and folders that are there whole or not at all: written aside, then renamed."""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def write_bytes_aside(path: Path, data: bytes) -> None:
    """Write a file so that a reader, or a killed writer, never sees half of it: a sibling is renamed over ``path``.

    Nothing is forced to the disk: this guards against a killed process, not against a power cut.
    Raises ``OSError`` where the folder is missing or cannot be written; nothing is left behind then.
    """
    aside = _sibling(path, "part")
    try:
        with aside.open("xb") as file:
            file.write(data)
        aside.replace(path)
    except BaseException:
        aside.unlink(missing_ok=True)
        raise


@contextmanager
def folder_aside(final: Path) -> Iterator[Path]:
    """A new folder beside ``final`` to fill; it takes the name ``final`` at the end of the block.

    A folder of that name is replaced whole: whether it may be is the caller's business. Where the block raises,
    ``final`` is as it was and nothing is left aside. A killed process leaves ``final`` as it was too, and beside it a
    hidden folder ``.NAME.*.part`` that may be deleted; killed between the two renames of the end, it leaves the old
    folder as ``.NAME.*.old``. Missing parents are made.

    Raises ``OSError`` where the parent cannot be written, ``NotADirectoryError`` where ``final`` is a file.
    """
    final = final.resolve()
    if final.exists() and not final.is_dir():
        raise NotADirectoryError(f"{final} is a file, not a folder")
    final.parent.mkdir(parents=True, exist_ok=True)
    aside = _sibling(final, "part")
    aside.mkdir()
    try:
        yield aside
        _swap(aside, final)
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _swap(aside: Path, final: Path) -> None:
    if not final.exists():
        aside.rename(final)
        return
    old = _sibling(final, "old")
    final.rename(old)
    try:
        aside.rename(final)
    except BaseException:
        old.rename(final)
        raise
    shutil.rmtree(old)


def _sibling(path: Path, suffix: str) -> Path:
    # Same folder, so that a rename never crosses a file system; a name of its own, so that two writers never meet.
    return path.with_name(f".{path.name[:200]}.{secrets.token_hex(4)}.{suffix}")
