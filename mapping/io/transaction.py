"""Transactions: the files of a folder change together or not at all, even if the writer is killed.

The new files are written to a hidden folder inside the folder that changes, with a journal that names them and the
files to delete. One rename of that hidden folder to ``COMMIT`` decides: before it, nothing has changed; after it, the
files are moved to their places, by the writer or by the next command that opens or writes the folder.

A folder that may be replaced holds a list of the files that were written into it, ``LEDGER_FILE``. Only files that a
list or a record of ours names are ever deleted, and nothing is written or deleted through a link to another folder.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import stat
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from mapping.io.atomic import (
    LOCK_FILE,
    locked_again,
    naming,
    remove_temporaries,
    temporary_folder,
    temporary_name,
    write_bytes_atomically,
)
from mapping.io.safe_load import read_json
from mapping.io.shape import require_shape

COMMIT = ".mapquilt-commit"
LEDGER_FILE = ".mapquilt-files.json"
_JOURNAL_FILE, _NEW_FILES = "journal.json", "files"


def write_files_atomically(files: Mapping[Path, bytes]) -> None:
    """Write files so that no reader sees a part of one, or some without the others, even if the writer is killed.

    They lie in one folder or below it. Raises as ``write_bytes_atomically``, and ``ValueError`` if a file lies behind a
    link to another folder. Nothing is written or left behind then.
    """
    if len(files) == 1:
        for path, data in files.items():
            write_bytes_atomically(path, data)
    elif files:
        folder = Path(os.path.commonpath([path.parent.absolute() for path in files]))
        if not folder.is_dir():
            raise FileNotFoundError(f"{folder}: no such folder")
        change_files(folder, files, ())


def change_files(folder: Path, files: Mapping[Path, bytes], stale: Iterable[str], *, ledger: bool = False) -> None:
    """Write files below a folder and delete the ``stale`` ones, by relative path, in one transaction.

    With ``ledger`` the folder's list of written files is kept up to date. Raises as ``write_files_atomically``.
    """
    base = Path(os.path.realpath(folder))
    finish_transaction(base)
    remove_temporaries(base, "mapquilt")
    names = {_relative(folder, path): data for path, data in files.items()}
    deleted = set(stale) - names.keys()
    if ledger:
        written = (written_files(base) | names.keys()) - deleted
        names[LEDGER_FILE] = _ledger_bytes(written)
    _check_places(base, names)
    with temporary_folder(base / "mapquilt") as aside:
        for name, data in names.items():
            place = aside / _NEW_FILES / name
            with naming(base / name):
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_bytes(data)
        _commit(base, aside, names, deleted)


@contextmanager
def added_files(folder: Path) -> Iterator[Path]:
    """Make a temporary folder to fill, whose files are added to ``folder``, and to its list, in one transaction at the
    end of the block.

    Files of the same name are replaced. If the block raises or the process is killed, ``folder`` is unchanged. Raises
    as ``atomic_folder``.
    """
    base = Path(os.path.realpath(folder))
    finish_transaction(base)
    remove_temporaries(base, "mapquilt")
    with temporary_folder(base / "mapquilt") as temporary:
        aside = temporary / _NEW_FILES
        aside.mkdir()
        with _named_as_in(base, aside):
            yield aside
            names = _file_names(aside)
            write_bytes_atomically(aside / LEDGER_FILE, _ledger_bytes(written_files(base) | names))
            _check_places(base, names)
            _commit(base, temporary, names | {LEDGER_FILE}, ())


@contextmanager
def _named_as_in(final: Path, aside: Path) -> Iterator[None]:
    """Name a temporary file in an error of the block as it would be in ``final``, and ``final`` if it names none, as
    that of a full disk."""
    try:
        yield
    except OSError as error:
        if error.filename is None and error.errno is not None:
            error.filename = str(final)
        elif error.filename is not None and Path(str(error.filename)).is_relative_to(aside):
            error.filename = str(final / Path(error.filename).relative_to(aside))
        raise


def _file_names(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@contextmanager
def atomic_folder(final: Path, *, ledger: bool = False, stale: Collection[str] = ()) -> Iterator[Path]:
    """Make a temporary folder to fill, whose files are those of ``final`` at the end of the block.

    If ``final`` exists, its files change in one transaction: those that its list names, and the ``stale`` ones by
    relative path, are replaced or deleted; all others stay as they are. The caller checks if it may be replaced. With
    ``ledger`` the list is written, so that it can be replaced later. If the block raises or the process is killed,
    ``final`` is unchanged. Missing parents are made.

    Raises ``OSError`` if the parent cannot be written, ``NotADirectoryError`` if ``final`` is a file, and
    ``ValueError`` if a file would be written through a link. An error of the block about a temporary file names it as
    it would be in ``final``.
    """
    final = Path(os.path.realpath(final))
    if final.exists() and not final.is_dir():
        raise NotADirectoryError(f"{final} is a file, not a folder")
    final.parent.mkdir(parents=True, exist_ok=True)
    remove_temporaries(final.parent, final.name)
    if final.exists():
        finish_transaction(final)
        remove_temporaries(final, "mapquilt")
    with temporary_folder(final / "mapquilt" if final.exists() else final) as temporary:
        aside = temporary / _NEW_FILES
        aside.mkdir()
        with _named_as_in(final, aside):
            yield aside
            _place(aside, final, ledger, stale)


def _place(aside: Path, final: Path, ledger: bool, stale: Collection[str]) -> None:
    names = _file_names(aside)
    if ledger:
        write_bytes_atomically(aside / LEDGER_FILE, _ledger_bytes(names))
        names |= {LEDGER_FILE}
    if aside.parent.parent != final:
        aside.rename(final)  # fails if another writer has made it meanwhile
        return
    finish_transaction(final)
    _check_places(final, names)
    _commit(final, aside.parent, names, (written_files(final) | {LEDGER_FILE, *stale}) - names)


def refuse_links(folder: Path, place: Path) -> None:
    """Raise ``ValueError`` if a place in a folder is a link or lies behind one, so that writing it leaves the folder.

    Links above the folder are the user's choice.
    """
    _checked_place(folder, (place / "file").relative_to(folder).as_posix())


def written_files(folder: Path) -> frozenset[str]:
    """Return the relative paths of the files that were written into a folder, as its list says; empty without one.

    Raises ``ValueError`` naming the list if it is damaged.
    """
    path = folder / LEDGER_FILE
    return _names(path, "files")[0] if os.path.lexists(path) else frozenset()


def finish_transaction(folder: Path) -> None:
    """Finish the transaction of a killed writer in a folder, if there is one; wait for that of a living writer.

    Raises ``ValueError`` if its journal is damaged, ``OSError`` if the folder cannot be written.
    """
    commit = folder / COMMIT
    while commit.is_dir():
        if commit.is_symlink():
            raise ValueError(f"{commit}: is a link, not a transaction of mapquilt; delete it")
        with locked_again(commit / LOCK_FILE, wait=True) as held:
            if held:
                _move_into_place(Path(os.path.realpath(folder)))
            elif commit.is_dir() and not (commit / LOCK_FILE).exists():
                raise ValueError(f"{commit}: is no transaction of mapquilt; delete it")


def _commit(folder: Path, aside: Path, names: Iterable[str], deleted: Iterable[str]) -> None:
    """Decide a transaction by one rename, and move its files into place. The caller holds the lock in ``aside``."""
    journal = {"write": sorted(names), "delete": sorted(deleted)}
    with naming(folder):
        (aside / _JOURNAL_FILE).write_text(json.dumps(journal), encoding="utf-8")
    while True:
        try:
            aside.rename(folder / COMMIT)
            break
        except OSError as error:
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                raise
            finish_transaction(folder)  # of another writer
    _move_into_place(folder)


def _move_into_place(folder: Path) -> None:
    """Do what a journal says. Every step can be repeated, so that a kill between two of them does no harm."""
    commit = folder / COMMIT
    written, deleted = _names(commit / _JOURNAL_FILE, "write", "delete")
    for name in sorted(written):
        source = _checked_place(commit, f"{_NEW_FILES}/{name}")
        if source.is_file():
            place = _checked_place(folder, name)
            place.parent.mkdir(parents=True, exist_ok=True)
            source.replace(place)
    for name in sorted(deleted):
        _delete(folder, name)
    done = temporary_name(folder / "mapquilt")
    commit.rename(done)
    shutil.rmtree(done, ignore_errors=True)


def _delete(folder: Path, name: str) -> None:
    """Delete a file, and the folders below ``folder`` that are empty then; nothing behind a link to a folder."""
    try:
        place = _checked_place(folder, name)
    except ValueError:
        return
    if place.is_symlink() or not place.is_dir():
        place.unlink(missing_ok=True)
    for parent in place.parents:
        if parent == folder or not parent.is_dir() or any(parent.iterdir()):
            break
        parent.rmdir()


def _check_places(folder: Path, names: Iterable[str]) -> None:
    """Check everything that could stop a transaction halfway, before it is decided."""
    for name in names:
        place = _checked_place(folder, name)
        if os.path.lexists(place) and not stat.S_ISREG(place.lstat().st_mode):
            raise FileExistsError(f"{place}: exists and is not a regular file; it is not replaced")
        parent = next(one for one in place.parents if one.exists())
        if not parent.is_dir():
            raise NotADirectoryError(f"{parent}: is not a folder")
        if not os.access(parent, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(parent))
        if parent.stat().st_dev != folder.stat().st_dev:
            raise ValueError(f"{parent}: is on another file system than {folder}, must be on the same")


def _checked_place(folder: Path, name: str) -> Path:
    """Return the place of a file in a folder. Raises ``ValueError`` if it lies outside, or behind a link."""
    parts = PurePosixPath(name).parts
    if not parts or name.startswith("/") or ".." in parts or parts[0] == COMMIT:
        raise ValueError(f"{folder}: file is {name[:100]!r}, must lie inside the folder")
    for depth in range(1, len(parts)):
        parent = folder.joinpath(*parts[:depth])
        if parent.is_symlink():
            raise ValueError(f"{parent}: is a link, through which nothing is written; remove it or name another folder")
    return folder.joinpath(*parts)


def _relative(folder: Path, path: Path) -> str:
    """Return the path in the folder of a file, or of the target of a link to a file in the same folder."""
    base = Path(os.path.realpath(folder))
    final = base / Path(os.path.relpath(path.absolute(), folder.absolute()))
    if final.is_symlink():
        if final.exists() and not final.is_file():
            raise FileExistsError(f"{path}: exists and is not a regular file; it is not replaced")
        final = Path(os.path.realpath(final))
        if not final.is_relative_to(base):
            raise ValueError(f"{path}: is a link to {final}, out of the folder that is written; remove it")
    return final.relative_to(base).as_posix()


def _ledger_bytes(names: Iterable[str]) -> bytes:
    return (json.dumps({"files": sorted(names)}, indent=1) + "\n").encode()


def _names(path: Path, *keys: str) -> list[frozenset[str]]:
    """Read lists of file names from a journal or a list of written files, which must be no link.

    Raises ``ValueError`` that names the file if it is damaged.
    """
    if path.is_symlink():
        raise ValueError(f"{path}: is a link, not a file of mapquilt; delete it")
    record = read_json(path)
    require_shape(record, {key: [str] for key in keys}, str(path))
    return [frozenset(record[key]) for key in keys]
