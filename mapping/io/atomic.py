"""Files and folders that are there whole or not at all: written aside, then renamed."""

from __future__ import annotations

import os
import secrets
import shutil
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path


def write_bytes_aside(path: Path, data: bytes) -> None:
    """Write one file as ``write_files_aside`` writes several."""
    write_files_aside({path: data})


def write_files_aside(files: Mapping[Path, bytes]) -> None:
    """Write files so that a reader, or a killed writer, never sees half of one, nor some without the others.

    All are written beside their final places, and renamed only when the last is whole. A link is followed: what it
    points to is replaced, the link stays. Nothing is forced to the disk: this guards against a killed process, not
    against a power cut.
    Raises ``OSError`` naming the file that cannot be written, or its folder, ``FileExistsError`` where a device, a
    folder or anything else that is no regular file has the name; nothing is written or left behind then.
    """
    finals = {_final(path): data for path, data in files.items()}
    asides = {final: _sibling(final, "part") for final in finals}
    try:
        for final, aside in asides.items():
            with naming(final), aside.open("xb") as file:
                file.write(finals[final])
        for final, aside in asides.items():
            aside.replace(final)
    except BaseException:
        for aside in asides.values():
            aside.unlink(missing_ok=True)
        raise


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Whatever the system refuses in the block names this file: a full disk does not say where it was full."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error


def _final(path: Path) -> Path:
    try:
        regular = stat.S_ISREG(path.stat().st_mode)
    except FileNotFoundError:
        regular = True
    if not regular:
        raise FileExistsError(f"{path}: is there and is no regular file; it is not replaced")
    final = Path(os.path.realpath(path)) if path.is_symlink() else path
    if not final.parent.is_dir():
        raise FileNotFoundError(f"{final.parent}: no such folder")
    return final


@contextmanager
def folder_aside(final: Path) -> Iterator[Path]:
    """A new folder beside ``final`` to fill; it takes the name ``final`` at the end of the block.

    A folder of that name is replaced whole: whether it may be is the caller's business. Where the block raises,
    ``final`` is as it was and nothing is left aside. A killed process leaves ``final`` as it was too, and beside it a
    hidden folder ``.NAME.*.part`` that may be deleted; killed between the two renames of the end, it leaves the old
    folder as ``.NAME.*.old``. Missing parents are made.

    Raises ``OSError`` where the parent cannot be written, ``NotADirectoryError`` where ``final`` is a file. What fails
    in the block on a file of ``aside`` names it as it would be in ``final``.
    """
    final = Path(os.path.realpath(final))
    if final.exists() and not final.is_dir():
        raise NotADirectoryError(f"{final} is a file, not a folder")
    final.parent.mkdir(parents=True, exist_ok=True)
    aside = _sibling(final, "part")
    aside.mkdir()
    try:
        yield aside
        _swap(aside, final)
    except OSError as error:
        if error.filename is not None and Path(str(error.filename)).is_relative_to(aside):
            error.filename = str(final / Path(error.filename).relative_to(aside))
        raise
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
