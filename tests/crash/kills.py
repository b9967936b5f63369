"""One verb, killed at the n-th change that it makes to the disk."""

from __future__ import annotations

import hashlib
import mmap
import os
import shutil
import signal
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mapping.io.atomic import remove_temporaries
from mapping.io.transaction import LEDGER_FILE, finish_transaction

CHANGES = frozenset({"open", "os.rename", "os.remove", "os.rmdir", "os.mkdir"})
"""Audit events of the interpreter that change the disk; ``open`` if it is for writing."""

UNEQUAL = frozenset(
    {"timings.json", "timings.csv", "time.png", ".trials.jsonl", "table.md", "reliability.png", ".lock", LEDGER_FILE}
)
"""Files that hold times, only list the others, or are drawn after a benchmark is written."""


@dataclass(frozen=True)
class Case:
    """A verb that returns its exit status, the folder that it changes, and the folder of which a copy is there before.

    A job that is ``resumed`` runs again after the kill, and must then leave the bytes of a run without a kill.
    """

    name: str
    verb: Callable[[], int]
    out: Path
    before: Path | None
    resumed: bool = False


def prepare(case: Case) -> None:
    """Restore the state before the verb."""
    for folder in (case.out, case.out.with_name(f".{case.out.name}.unfinished")):
        shutil.rmtree(folder, ignore_errors=True)
    if case.before is not None:
        shutil.copytree(case.before, case.out)
        (case.out / "notes.txt").write_text("mine")


def content(folder: Path) -> dict[str, str]:
    """Hash each file below a folder, but for those that need not be equal."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in UNEQUAL
    }


def killed(case: Case, last: int, work: Path) -> tuple[bool, int]:
    """Run the verb in a child that is killed just before its change number ``last`` below ``work``.

    Return if it was killed, and the number of its changes.
    """
    counter = mmap.mmap(-1, 8)
    child = os.fork()
    if child == 0:
        _silence()
        _kill_at(last, str(work), counter)
        os._exit(0 if case.verb() in (0, 1) else 3)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGKILL:
        return True, last
    if status != 0:
        raise RuntimeError(f"{case.name}: ended with status {os.waitstatus_to_exitcode(status)}")
    return False, int.from_bytes(counter[:8])


def _silence() -> None:
    null = os.open(os.devnull, os.O_RDWR)
    for stream in (1, 2):
        os.dup2(null, stream)


def _kill_at(last: int, work: str, counter: mmap.mmap) -> None:
    changes = 0

    def audit(event: str, arguments: tuple[object, ...]) -> None:
        nonlocal changes
        if event not in CHANGES or not str(arguments[0]).startswith(work):
            return
        if event == "open" and not set(str(arguments[1])) & set("wxa+"):
            return
        changes += 1
        counter[:8] = changes.to_bytes(8)
        if changes == last:
            os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(audit)


def recovered(case: Case, work: Path) -> dict[str, str]:
    """Return the content of the folder as the next command finds it, or as the same one leaves it if it is resumed."""
    if case.resumed:
        killed(case, 0, work)
        return content(case.out)
    remove_temporaries(case.out.parent)
    if not case.out.exists():
        return {}
    finish_transaction(case.out)
    remove_temporaries(case.out)
    return content(case.out)


def states(case: Case, work: Path) -> tuple[dict[str, str], dict[str, str], int]:
    """Return the content before the verb and after it, and the number of changes between them."""
    prepare(case)
    old = content(case.out) if case.out.exists() else {}
    was_killed, changes = killed(case, 0, work)
    if was_killed:
        raise RuntimeError(f"{case.name}: was killed by something else")
    return old, content(case.out), changes
