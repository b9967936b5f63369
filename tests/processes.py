"""Commands as processes of their own, to be killed or to run out of disk."""

from __future__ import annotations

import resource
import signal
import subprocess
import sys
import time
from pathlib import Path


def started(*arguments: object, file_bytes: int = resource.RLIM_INFINITY) -> subprocess.Popen[str]:
    """Start the command in a process of its own, none of whose files grows beyond ``file_bytes``."""
    words = [sys.executable, "-m", "mapquilt", *map(str, arguments)]

    def prepare() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (file_bytes, resource.RLIM_INFINITY))
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # a job in the background would ignore it

    return subprocess.Popen(
        words,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=prepare,
    )


def wait_for_entry(journal: Path, running: subprocess.Popen[str]) -> None:
    while running.poll() is None and not (journal.is_file() and journal.stat().st_size):
        time.sleep(0.02)


def last_line(done: subprocess.Popen[str]) -> str:
    return done.communicate(timeout=120)[1].strip().splitlines()[-1]
