"""Show progress on standard error, if it is a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn


def _bar(*columns: str) -> Progress:
    console = Console(stderr=True)
    texts = [TextColumn(column) for column in columns]
    parts = (texts[0], BarColumn(), *texts[1:], TimeRemainingColumn())
    return Progress(*parts, console=console, transient=True, disable=not console.is_terminal)


def mapping_label() -> str:
    """Name the work of mapping; say so if SLAM must be compiled first, which takes some 20 s, once."""
    from mapping.compile_cache import is_compiled
    from mapping.slam.tracking.matching import register_points

    return "mapping" if is_compiled(register_points) else "mapping (first, once, compiling SLAM)"


@contextmanager
def mission_progress(duration: float) -> Iterator[tuple[Callable[[float], None], Callable[[int, int], None]]]:
    """Show the simulated time with its real-time factor, and below it the steps of mapping.

    Yields two functions: the first takes the simulated time [s], the second the steps done and their total.
    """
    with _bar("{task.description}", "{task.completed:.0f}/{task.total:.0f}", "{task.fields[note]}") as bar:
        driving = bar.add_task("simulating", total=duration, note="s")
        mapping = bar.add_task(mapping_label(), total=1.0, note="steps", start=False, visible=False)

        def simulated(done: float) -> None:
            elapsed = bar.tasks[0].elapsed or 0.0
            bar.update(driving, completed=done, note=f"s, {done / elapsed:.0f} x real time" if elapsed > 0.5 else "s")

        def mapped(done: int, total: int) -> None:
            bar.start_task(mapping)
            bar.update(mapping, completed=done, total=total, visible=True)

        yield simulated, mapped


@contextmanager
def dataset_progress(samples: int) -> Iterator[Callable[[int, int], None]]:
    """Show the samples with failures, rate and time left. Yields a function of the numbers of samples done
    and failed."""
    columns = (
        "samples",
        "{task.completed:.0f}/{task.total:.0f}",
        "{task.fields[failed]} failed",
        "{task.fields[rate]}",
    )
    with _bar(*columns) as bar:
        task = bar.add_task("", total=samples, failed=0, rate="")
        began: list[int] = []

        def advance(done: int, failed: int) -> None:
            began.append(done + failed)
            minutes = (bar.tasks[0].elapsed or 0.0) / 60.0
            made = done + failed - began[0]
            rate = f"{made / minutes:.1f} a minute" if made and minutes else ""
            bar.update(task, completed=done + failed, failed=failed, rate=rate)

        yield advance


@contextmanager
def count_progress(what: str) -> Iterator[Callable[[int, int], None]]:
    """Show a count. Yields a function of the number done and the total."""
    with _bar(what, "{task.completed:.0f}/{task.total:.0f}") as bar:
        task = bar.add_task("", total=1.0)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def pair_progress() -> Iterator[tuple[Callable[[int, int], None], Callable[[str, int, int], None]]]:
    """Show the count of merged pairs, and the iterations inside the pair that is matched in this process.

    Yields two functions: of the pairs done and their total, and of the iterations' name, number done and total.
    """
    with _bar("merging pairs", "{task.completed:.0f}/{task.total:.0f}", "{task.fields[inside]}") as bar:
        task = bar.add_task("", total=1.0, inside="")

        def matched(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total, inside="")

        def iterated(name: str, done: int, total: int) -> None:
            bar.update(task, inside=f"{name} {done}/{total}")

        yield matched, iterated
