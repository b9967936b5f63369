"""What a process and its workers hold in memory, shared pages counted once."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Thread

PERIOD = 0.1
"""Seconds between two looks."""


@dataclass
class PeakMemory:
    """The most that was seen at one time [MB]: in all, of this process, and of each of its descendants the most."""

    whole: float = 0.0
    own: float = 0.0
    largest_worker: float = 0.0

    def look(self) -> None:
        """Take what is held now into account."""
        held = {process: _proportional(process) for process in _tree(os.getpid())}
        own = held.pop(os.getpid())
        self.whole = max(self.whole, own + sum(held.values()))
        self.own = max(self.own, own)
        self.largest_worker = max(self.largest_worker, *held.values(), 0.0)


@contextmanager
def peak_memory() -> Iterator[PeakMemory]:
    """The peak of the summed proportional set size (Pss, proc(5)) of this process and its descendants while the block
    runs, looked at ten times a second. Raises ``OSError`` where there is no /proc/PID/smaps_rollup, as off Linux."""
    peak, over = PeakMemory(), Event()
    peak.look()

    def watch() -> None:
        while not over.wait(PERIOD):
            peak.look()

    watcher = Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield peak
    finally:
        over.set()
        watcher.join()


def _tree(root: int) -> list[int]:
    """A process and its descendants."""
    found = [root]
    for process in found:
        for task in _tasks(process):
            found += [int(child) for child in _text(task / "children").split()]
    return found


def _tasks(process: int) -> list[Path]:
    try:
        return list(Path(f"/proc/{process}/task").iterdir())
    except FileNotFoundError:
        return []  # it ended meanwhile


def _proportional(process: int) -> float:
    lines = _text(Path(f"/proc/{process}/smaps_rollup")).splitlines()
    return sum(int(line.split()[1]) / 1024.0 for line in lines if line.startswith("Pss:"))


def _text(path: Path) -> str:
    try:
        return path.read_text()
    except (FileNotFoundError, ProcessLookupError):
        return ""
