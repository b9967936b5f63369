"""Atomic files: written under a temporary name, then renamed."""

from __future__ import annotations

import fcntl
import os
import re
import secrets
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

LOCK_FILE = "lock"
"""File in a temporary folder that its writer locks; a temporary file is locked itself."""

_TEMPORARY = re.compile(r"\..+\.[0-9a-f]{16}\.part")


def write_bytes_atomically(path: Path, data: bytes) -> None:
    """Write a file so that no reader sees a part of it, even if the writer is killed; what killed writers of the same
    file left is removed.

    The target of a link is replaced; the link stays. Nothing is flushed to the disk: a power cut may still lose files.

    Raises ``OSError`` naming the file or folder that cannot be written, and ``FileExistsError`` if the name belongs to
    anything but a regular file. Nothing is written or left behind then.
    """
    final = _final(path)
    with naming(final):
        remove_temporaries(final.parent, final.name)
        temporary, file = _locked_file(final)
    try:
        with naming(final), file:  # open until the file has its name, since the lock ends with it
            file.write(data)
            file.flush()
            temporary.replace(final)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Add the file's name to an ``OSError`` of the block: that of a full disk has none."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error


@contextmanager
def temporary_folder(beside: Path) -> Iterator[Path]:
    """Make a hidden folder beside a path, hold its lock, and delete it at the end of the block."""
    while True:
        temporary = temporary_name(beside)
        temporary.mkdir()
        try:
            lock = _locked(temporary / LOCK_FILE)
        except FileNotFoundError:
            lock = None
        if lock is not None:
            break
    with lock:
        try:
            yield temporary
        finally:
            shutil.rmtree(temporary, ignore_errors=True)


def temporary_name(path: Path) -> Path:
    """Return a hidden name in the same folder, so that a rename never crosses a file system, that nobody else uses."""
    return path.with_name(f".{path.name[:200]}.{secrets.token_hex(8)}.part")


def remove_temporaries(folder: Path, name: str | None = None) -> None:
    """Delete the temporary files and folders that killed writers left in a folder, only those of ``name`` if given.

    Those of living writers, whose locks are held, stay, and so does everything if the folder cannot be written.
    """
    if not os.access(folder, os.W_OK):
        return
    prefix = "." if name is None else f".{name[:200]}."
    with os.scandir(folder) as entries:  # a data set's folder has thousands
        found = [one.name for one in entries if one.name.startswith(prefix) and _TEMPORARY.fullmatch(one.name)]
    for temporary in found:
        _remove_dead(folder / temporary)


def _remove_dead(temporary: Path) -> None:
    try:
        mode = temporary.lstat().st_mode
        if stat.S_ISDIR(mode):
            with locked_again(temporary / LOCK_FILE, wait=False) as held:
                if held:
                    shutil.rmtree(temporary)
            if not (temporary / LOCK_FILE).exists() and temporary.exists():
                temporary.rmdir()  # killed between the first two steps; a living writer starts again
        elif stat.S_ISREG(mode):
            with locked_again(temporary, wait=False) as held:
                if held:
                    temporary.unlink()
    except FileNotFoundError:
        return  # its writer, or another command that cleans up, was faster


@contextmanager
def locked_again(path: Path, wait: bool) -> Iterator[bool]:
    """Lock a writer's file once more; False if the writer lives (without ``wait``) or the file is gone."""
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW)
    except FileNotFoundError:
        yield False
        return
    with os.fdopen(descriptor, "r+b") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
            return
        yield _is_named(file, path)


def _locked_file(final: Path) -> tuple[Path, IO[bytes]]:
    while True:
        temporary = temporary_name(final)
        file = _locked(temporary)
        if file is not None:
            return temporary, file


def _locked(path: Path) -> IO[bytes] | None:
    """Create a file and lock it; None if it was taken for a dead writer's before it was locked."""
    file = path.open("xb")
    fcntl.flock(file, fcntl.LOCK_EX)
    if _is_named(file, path):
        return file
    file.close()
    return None


def _is_named(file: IO[bytes], path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(file.fileno()), path.lstat())
    except FileNotFoundError:
        return False


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
