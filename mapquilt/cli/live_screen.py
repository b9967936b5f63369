"""Output of a live merge: a view that follows it on a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import typer
from rich.console import Console
from rich.live import Live
from rich.text import Text

from mapping.io.safe_load import printable
from mapquilt.live.live_merger import LiveMerger
from mapquilt.live.terminal_view import MergeRate, overview


class LiveScreen:
    """Tell what happens, and draw the state of a merge below it if the output is a terminal."""

    def __init__(self, merger: LiveMerger, view: Live | None = None, period: float = 0.5) -> None:
        self._merger, self._view, self._period = merger, view, period
        self._rate, self._drawn = MergeRate(), 0.0

    def tell(self, seconds: float, events: Sequence[str]) -> None:
        """Print what has changed, and when [s] since the start."""
        for event in events:
            line = f"{seconds:8.1f} s  {printable(event)}"
            if self._view is None:
                typer.echo(line)
            else:
                self._view.console.print(Text(line), soft_wrap=True)

    def show(self, now: float | None, seconds: float | None) -> None:
        """Count an update that took ``seconds``, and draw the state at ``now`` [s] if the view is too old."""
        clock = time.monotonic()
        if seconds is not None:
            self._rate.add(seconds, clock)
        if self._view is not None and clock - self._drawn >= self._period:
            self._drawn = clock
            state, height = self._merger.state, self._view.console.height
            drawn = overview(
                state,
                now,
                self._rate.text(clock),
                frozen=self._merger.frozen,
                settings=self._merger.settings,
                height=height,
            )
            self._view.update(drawn, refresh=True)


@contextmanager
def live_screen(merger: LiveMerger, period: float = 0.5) -> Iterator[LiveScreen]:
    """Open the screen of a merge, drawn every ``period`` [s] at most; the view goes when the block ends."""
    console = Console(highlight=False, markup=False, emoji=False)
    if not console.is_terminal:
        yield LiveScreen(merger)
        return
    with Live(console=console, auto_refresh=False, transient=True) as view:
        yield LiveScreen(merger, view, period)
