"""Signals that a running command heeds at its next step."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Signals:
    """Signals that came: ``ended`` by SIGINT or SIGTERM; SIGUSR1 and SIGUSR2 wait until they are taken."""

    def __init__(self) -> None:
        self.ended = False
        self._waiting: set[int] = set()

    def take(self, number: signal.Signals) -> bool:
        """Check if a signal came since the last call."""
        came = number in self._waiting
        self._waiting.discard(number)
        return came

    def on_signal(self, number: int, frame: FrameType | None) -> None:
        """Remember a signal. A second one that ends the command ends it at once."""
        if number in (signal.SIGINT, signal.SIGTERM):
            if self.ended:
                raise KeyboardInterrupt
            self.ended = True
        else:
            self._waiting.add(number)


@contextmanager
def heeded_signals() -> Iterator[Signals]:
    """Heed signals in this block, and restore their handlers behind it."""
    heeded = Signals()
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1, signal.SIGUSR2)
    before = {number: signal.signal(number, heeded.on_signal) for number in numbers}
    try:
        yield heeded
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
