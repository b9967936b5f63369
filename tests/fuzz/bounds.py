"""Bounds on one case: time by timers of the process, memory by a limit of it."""

from __future__ import annotations

import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

SECONDS = 10.0
"""Most processor time of a case. A damaged file of some kilobytes takes milliseconds."""

WAITING = 60.0
"""Longest time of a case [s], which a busy machine may stretch; one that waits for a pipe takes no processor time."""

MEMORY = 2**30
"""Most memory that a case may add [bytes]."""


class TooLongError(BaseException):
    """A case that takes too long; no reader may catch it."""


@contextmanager
def bounded(seconds: float = SECONDS) -> Iterator[None]:
    """Raise ``TooLongError`` in a block that takes longer, and ``MemoryError`` in one that takes more memory."""

    def too_long(number: int, frame: FrameType | None) -> None:
        raise TooLongError(f"took more than {seconds:g} s of the processor, or {WAITING:g} s")

    before = {number: signal.signal(number, too_long) for number in (signal.SIGALRM, signal.SIGPROF)}
    limits = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (_address_space() + MEMORY, limits[1]))
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.setitimer(signal.ITIMER_REAL, WAITING)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, handler in before.items():
            signal.signal(number, handler)
        resource.setrlimit(resource.RLIMIT_AS, limits)


def _address_space() -> int:
    """Return the size of this process [bytes]."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
