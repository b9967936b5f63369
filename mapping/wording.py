"""Wording of messages: counts with their noun, and the known name that is nearest to a wrong one."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def counted(number: int, noun: str, plural: str | None = None) -> str:
    """Write a number with its noun, such as ``1 pair`` and ``0 pairs``; ``plural`` is for those not made by an s."""
    return f"{number} {noun if number == 1 else plural or f'{noun}s'}"


def merged_count(placed: int, total: int) -> str:
    """Write the number of merged maps of a group, such as ``2 of 3 maps merged``; a map alone is merged with none."""
    return f"{placed if placed > 1 else 'none'} of {counted(total, 'map')} merged"


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Ask for the known name that is nearest, such as ``; did you mean office?``; empty if none is near."""
    near = difflib.get_close_matches(name, list(known), n=1)
    return f"; did you mean {near[0]}?" if near else ""


def fixed(value: float, places: int) -> str:
    """Write a number with fixed decimal places, and a zero without a minus."""
    return f"{round(value, places) + 0.0:.{places}f}"


def duration(seconds: float) -> str:
    """Write a time in the unit that suits it, such as ``30 s``, ``12 min`` or ``3.5 h``."""
    for size, unit in ((3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.2g} {unit}" if seconds < 100.0 * size else f"{seconds / size:,.0f} {unit}"
    return f"{seconds:.0f} s" if seconds >= 10.0 else f"{seconds:.2g} s"
