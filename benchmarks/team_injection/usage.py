"""Memory and processor time of a process and its workers, with shared pages counted once."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event, Thread

PERIOD = 0.3
"""Seconds between two samples."""

TICK = 1.0 / os.sysconf("SC_CLK_TCK")


@dataclass
class Usage:
    """Peak memory [MB] in all, of this process and of one descendant; processor time [s] since the first sample."""

    whole: float = 0.0
    own: float = 0.0
    largest_worker: float = 0.0
    _began: dict[int, float] = field(default_factory=dict)
    _ran: dict[int, float] = field(default_factory=dict)

    @property
    def seconds(self) -> float:
        return sum(ran - self._began[process] for process, ran in self._ran.items())

    def sample(self) -> None:
        """Sample the current usage."""
        processes = _tree(os.getpid())
        first = not self._ran
        held = {process: _proportional(process) for process in processes}
        for process in processes:
            ran = _ran(process)
            if ran is not None:
                self._ran[process] = ran
                self._began.setdefault(process, ran if first else 0.0)
        own = held.pop(os.getpid())
        self.whole = max(self.whole, own + sum(held.values()))
        self.own = max(self.own, own)
        self.largest_worker = max(self.largest_worker, *held.values(), 0.0)


@contextmanager
def usage() -> Iterator[Usage]:
    """Measure this process and its descendants while the block runs, by proportional set sizes (Pss, proc(5)).

    Linux only: elsewhere the result stays 0.
    """
    used, over = Usage(), Event()
    used.sample()

    def watch() -> None:
        while not over.wait(PERIOD):
            used.sample()

    watcher = Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield used
    finally:
        over.set()
        watcher.join()
        used.sample()


def _tree(root: int) -> list[int]:
    """List a process and its descendants."""
    found = [root]
    for process in found:
        for task in _tasks(process):
            found += [int(child) for child in _text(task / "children").split()]
    return found


def _tasks(process: int) -> list[Path]:
    try:
        return list(Path(f"/proc/{process}/task").iterdir())
    except FileNotFoundError:
        return []  # the process has ended


def _proportional(process: int) -> float:
    lines = _text(Path(f"/proc/{process}/smaps_rollup")).splitlines()
    return sum(int(line.split()[1]) / 1024.0 for line in lines if line.startswith("Pss:"))


def _ran(process: int) -> float | None:
    after_name = _text(Path(f"/proc/{process}/stat")).rpartition(")")[2].split()
    return (int(after_name[11]) + int(after_name[12])) * TICK if after_name else None


def _text(path: Path) -> str:
    try:
        return path.read_text()
    except (FileNotFoundError, ProcessLookupError):
        return ""
