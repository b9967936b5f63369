"""Resumable jobs: a folder that one process holds, and a journal of the tasks that are finished."""

from __future__ import annotations

import json
import os
import stat
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from filelock import FileLock, Timeout

from mapping.io.atomic import naming, remove_temporaries, write_bytes_atomically
from mapping.io.safe_load import MAX_BYTES, json_value, read_limited
from mapping.io.transaction import change_files, finish_transaction
from mapquilt.jobs.runner import Progress, Runner, UnfinishedError, WorkerDeathError

LOCK_FILE = ".lock"
JOURNAL_FILE = ".journal.jsonl"
TASKS_FILE = "tasks.json"

SYNC_INTERVAL = 1.0
"""Longest time that an entry waits to be forced to the disk [s]: a force costs milliseconds, and thousands of tasks may
end in a second. What the power failure of a machine loses is done again; a kill of the process loses nothing."""

Task = TypeVar("Task")
Result = TypeVar("Result")
Entry = dict[str, Any]


def unfinished_folder(out: Path) -> Path:
    """Name the folder beside ``out`` that holds its unfinished work."""
    return out.with_name(f".{out.name}.unfinished")


@contextmanager
def job_folder(folder: Path, kind: str, settings_file: str, settings: str) -> Iterator[None]:
    """Hold a folder for one job: a new or empty one, or one in which the same job was begun.

    ``settings_file`` holds ``settings``, the text that identifies the job, and marks the folder as ours; ``kind`` is
    what messages call it, such as ``data set``. Half-written files of a killed process are removed. The lock dies with
    the process.

    Raises ``ValueError`` if the folder holds anything else, a job with other settings, or another process works in it,
    and ``OSError`` at the end if it was moved or deleted during the work.
    """
    path = folder / settings_file
    if folder.is_dir():
        finish_transaction(folder)
        remove_temporaries(folder)
    if path.exists():
        if read_limited(path, MAX_BYTES, may_be_empty=True) != settings.encode():
            raise ValueError(f"{folder}: holds a {kind} with other settings; choose another folder")
    else:
        if folder.exists() and not folder.is_dir():
            raise ValueError(f"{folder}: exists and is not a folder")
        if folder.exists() and any(child.name != LOCK_FILE for child in folder.iterdir()):
            raise ValueError(f"{folder}: is not empty and not a {kind}; refusing to write into it")
        folder.mkdir(parents=True, exist_ok=True)
        write_bytes_atomically(path, settings.encode())
    try:
        with FileLock(folder / LOCK_FILE, timeout=0):
            recover_folders(folder)
            held = HeldFolder.at(folder)
            yield
            held.check()
    except Timeout:
        raise ValueError(f"{folder}: another mapquilt process is writing into it; wait until it ends") from None


@dataclass(frozen=True)
class HeldFolder:
    """Name a job's folder and its lock file, by device and inode: they show if the folder is still the same one."""

    path: Path
    lock: tuple[int, int]

    @staticmethod
    def at(path: Path) -> HeldFolder:
        """Return the folder that a job holds now."""
        return HeldFolder(path, _inode(path / LOCK_FILE))

    def check(self) -> None:
        """Raise ``OSError`` if the folder was moved, deleted or replaced since."""
        try:
            same = _inode(self.path / LOCK_FILE) == self.lock
        except OSError:
            same = False
        if not same:
            raise OSError(f"{self.path}: was moved or deleted during the work; put it back, and the command continues")


def _inode(path: Path) -> tuple[int, int]:
    status = path.stat()
    return status.st_dev, status.st_ino


def recover_folders(folder: Path) -> None:
    """Finish or remove what killed writers left in a job's folder, in those below it, and in those below them.

    Nothing behind a link is touched, nor what a living writer holds.
    """
    inner = [one for one in folder.iterdir() if _is_own(one)]
    for place in (folder, *inner, *(one for each in inner for one in each.iterdir() if _is_own(one))):
        finish_transaction(place)
        remove_temporaries(place)


def _is_own(path: Path) -> bool:
    return not path.name.startswith(".") and path.is_dir() and not path.is_symlink()


def remove_job(folder: Path, settings_file: str) -> None:
    """Delete the files of a finished job, and its folder if nothing else is in it."""
    if not folder.is_dir():
        return
    change_files(folder, {}, (settings_file, JOURNAL_FILE))
    (folder / LOCK_FILE).unlink(missing_ok=True)
    if not any(folder.iterdir()):
        folder.rmdir()


class Entries(Mapping[str, Entry]):
    """Entries of a journal by task. Each is read from the file on access; memory holds only where it is."""

    def __init__(self, path: Path, places: Mapping[str, int]) -> None:
        self._path = path
        self._places = places

    def __getitem__(self, task: str) -> Entry:
        place = self._places[task]
        with self._path.open("rb") as file:
            file.seek(place)
            entry: Entry = json.loads(file.readline())
            return entry

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)


def counting(on_progress: Progress, total: int) -> Callable[[Mapping[str, Entry]], None]:
    """Return a function that adds up the entries that it is called with, and tells how many of ``total`` they are."""
    done = 0

    def count(entries: Mapping[str, Entry]) -> None:
        nonlocal done
        done += len(entries)
        on_progress(done, total)

    return count


class Journal(Generic[Task]):
    """Append one line of JSON per finished task, whose results memory need not hold then.

    ``key`` names a task; its entry holds the name under ``"task"``, in studies of version 1 under ``"mission"``, and
    ``check`` raises ``ValueError`` that begins with the given place if the rest of an entry is damaged.
    """

    def __init__(
        self, path: Path, key: Callable[[Task], str], check: Callable[[Entry, str], None] = lambda entry, place: None
    ) -> None:
        self.path = path
        self.key = key
        self.check = check
        self._synced = time.monotonic()
        self._known: dict[str, int] | None = None

    def entries(self) -> Entries:
        """Check the entries, and return them by task. A last line that a kill cut short is removed from the file.

        Raises ``ValueError`` naming file, line and field if another line is damaged.
        """
        return Entries(self.path, self._places())

    def _places(self) -> dict[str, int]:
        """Return the first byte of the last entry of each task; the file is read the first time only."""
        if self._known is None:
            self._known = self._read_places()
        return self._known

    def _read_places(self) -> dict[str, int]:
        if not self.path.exists():
            return {}
        if not stat.S_ISREG(self.path.stat().st_mode):
            raise ValueError(f"{self.path}: not a file")
        places, end, number = dict[str, int](), 0, 0
        with self.path.open("rb") as file:
            while (line := file.readline(MAX_BYTES)).endswith(b"\n"):
                number += 1
                entry = self._entry(line, number)
                places[str(entry.get("task", entry.get("mission")))] = end
                end += len(line)
        if line:
            os.truncate(self.path, end)
        return places

    def _entry(self, line: bytes, number: int) -> Entry:
        place = f"{self.path}: line {number}"
        entry = json_value(line, place)
        if not isinstance(entry, dict) or not isinstance(entry.get("task", entry.get("mission")), str | int):
            raise ValueError(f"{place}: names no task; delete the file, and all is made again")
        self.check(entry, place)
        return entry

    def run(
        self,
        runner: Runner,
        function: Callable[[Task], Result],
        tasks: Sequence[Task],
        keep: Callable[[Task, Result | BaseException], Entry],
        is_whole: Callable[[Task, Entry], bool] = lambda task, entry: True,
        on_entries: Callable[[Mapping[str, Entry]], None] = lambda entries: None,
    ) -> Entries:
        """Run the tasks that have no entry yet, and return the entries of all tasks in their order.

        ``keep`` stores a result, or the error that a task raised, and returns its entry. A task whose entry is not
        ``is_whole``, because a file was damaged or deleted, runs again. ``on_entries`` is called with the entries of
        older calls, then with each new one.

        A fault of the machine never becomes an entry. An ``OSError`` of a task is raised at once. A task whose workers
        died, that had too little memory, or that met an error of the program is left, and the others run first; then
        the error of the program is raised, or else ``UnfinishedError``.
        """
        held = HeldFolder.at(self.path.parent)
        places, missing = self._places(), []
        known, done = Entries(self.path, places), dict[str, int]()
        for task in tasks:
            name = self.key(task)
            entry = known.get(name)
            if entry is not None and is_whole(task, entry):
                done[name] = places[name]
            else:
                missing.append(task)
        on_entries(Entries(self.path, dict(done)))
        faults: dict[str, BaseException] = {}
        with closing(runner.completed(function, missing)) as results:
            for task, result in results:
                held.check()
                if isinstance(result, OSError) and not isinstance(result, WorkerDeathError):
                    raise result
                if isinstance(result, BaseException) and not isinstance(result, ValueError):
                    faults[self.key(task)] = result
                    continue
                entry = {"task": self.key(task), **keep(task, result)}
                held.check()
                done[self.key(task)] = places[self.key(task)] = self._append(entry)
                on_entries({self.key(task): entry})
        self._sync()
        for fault in faults.values():
            if not isinstance(fault, WorkerDeathError | MemoryError):
                raise fault
        if faults:
            name, fault = next(iter(faults.items()))
            raise UnfinishedError(
                f"{self.path.parent}: is unfinished: {len(faults)} of {len(tasks)} tasks were not done, the first is "
                f"{name}: {str(fault) or 'memory was too short'}; the same command tries again"
            )
        return Entries(self.path, {self.key(task): done[self.key(task)] for task in tasks})

    def _append(self, entry: Entry) -> int:
        """Write an entry, and return its first byte."""
        with naming(self.path), self.path.open("ab") as file:
            place = file.tell()
            file.write(json.dumps(entry, allow_nan=False).encode() + b"\n")
        if time.monotonic() - self._synced > SYNC_INTERVAL:
            self._sync()
        return place

    def _sync(self) -> None:
        """Force all entries to the disk."""
        if self.path.exists():
            with naming(self.path), self.path.open("ab") as file:
                os.fsync(file.fileno())
        self._synced = time.monotonic()

    def remove(self) -> None:
        """Delete the journal."""
        self.path.unlink(missing_ok=True)
        self._known = None
