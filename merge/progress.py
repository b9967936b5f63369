"""Progress inside the match of a pair: which iterations run, and how far they are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

Item = TypeVar("Item")

OnIteration = Callable[[str, int, int], None]
"""Called with the name of the iterations, the number done and their total."""

_LISTENER: ContextVar[OnIteration | None] = ContextVar("listener", default=None)


@contextmanager
def listening(listener: OnIteration | None) -> Iterator[None]:
    """Report the iterations within the block, in this thread, to a listener."""
    token = _LISTENER.set(listener)
    try:
        yield
    finally:
        _LISTENER.reset(token)


def track(items: Sequence[Item], name: str) -> Iterator[Item]:
    """Yield the items, and report each as an iteration of that name once it is done."""
    listener = _LISTENER.get()
    for done, item in enumerate(items, start=1):
        yield item
        if listener is not None:
            listener(name, done, len(items))
