"""Atomic files and folders: written under a temporary name, then renamed."""

from __future__ import annotations

import os
import secrets
import shutil
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path


def write_bytes_atomically(path: Path, data: bytes) -> None:
    """Write one file as ``write_files_atomically`` writes several."""
    write_files_atomically({path: data})


def write_files_atomically(files: Mapping[Path, bytes]) -> None:
    """Write files so that no reader sees a part of one, or some without the others, even if the writer is killed.

    All are written to temporary names in the same folders, and renamed when the last is complete. The target of a link
    is replaced; the link stays. Nothing is flushed to the disk: a power cut may still lose files.

    Raises ``OSError`` naming the file or folder that cannot be written, and ``FileExistsError`` if the name belongs to
    anything but a regular file. Nothing is written or left behind then.
    """
    finals = {_final(path): data for path, data in files.items()}
    temporaries = {final: _sibling(final, "part") for final in finals}
    try:
        for final, temporary in temporaries.items():
            with naming(final), temporary.open("xb") as file:
                file.write(finals[final])
        for final, temporary in temporaries.items():
            temporary.replace(final)
    except BaseException:
        for temporary in temporaries.values():
            temporary.unlink(missing_ok=True)
        raise


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Add the file's name to an ``OSError`` of the block: that of a full disk has none."""
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
        raise FileExistsError(f"{path}: exists and is not a regular file; it is not replaced")
    final = Path(os.path.realpath(path)) if path.is_symlink() else path
    if not final.parent.is_dir():
        raise FileNotFoundError(f"{final.parent}: no such folder")
    return final


@contextmanager
def atomic_folder(final: Path) -> Iterator[Path]:
    """Make a temporary folder to fill, which is renamed to ``final`` at the end of the block.

    A folder of that name is replaced; the caller checks if it may be. If the block raises, ``final`` is unchanged and
    the temporary folder is deleted. A killed process leaves ``final`` unchanged too, and a hidden folder
    ``.NAME.*.part`` that may be deleted; killed between the two renames at the end, it leaves the old folder as
    ``.NAME.*.old``. Missing parents are made.

    Raises ``OSError`` if the parent cannot be written, and ``NotADirectoryError`` if ``final`` is a file. An error of
    the block about a temporary file names it as it would be in ``final``.
    """
    final = Path(os.path.realpath(final))
    if final.exists() and not final.is_dir():
        raise NotADirectoryError(f"{final} is a file, not a folder")
    final.parent.mkdir(parents=True, exist_ok=True)
    temporary = _sibling(final, "part")
    temporary.mkdir()
    try:
        yield temporary
        _swap(temporary, final)
    except OSError as error:
        if error.filename is not None and Path(str(error.filename)).is_relative_to(temporary):
            error.filename = str(final / Path(error.filename).relative_to(temporary))
        raise
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _swap(temporary: Path, final: Path) -> None:
    if not final.exists():
        temporary.rename(final)
        return
    old = _sibling(final, "old")
    final.rename(old)
    try:
        temporary.rename(final)
    except BaseException:
        old.rename(final)
        raise
    shutil.rmtree(old)


def _sibling(path: Path, suffix: str) -> Path:
    # Same folder, so that a rename never crosses a file system; a name of its own, so that two writers never meet.
    return path.with_name(f".{path.name[:200]}.{secrets.token_hex(4)}.{suffix}")
