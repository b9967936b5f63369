"""The first lines of a report: what the answers come to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapquilt.benchmark.table import number_text, share_text, wrong_text
from mapquilt.evaluation.statistics import Share
from mapquilt.report.answer import ReportAnswer, methods_of
from mapquilt.report.content import Content, Sheet


@dataclass(frozen=True)
class Tile:
    """A number and what it is; ``tone`` is good, bad or empty."""

    value: str
    words: str
    tone: str = ""


def headline(content: Content) -> str:
    """One sentence on the first method."""
    methods = methods_of(content.answers)
    if not methods:
        return f"{len(content.answers)} pairs of maps whose true transform is known; none has been merged yet."
    here = [one for one in content.answers if one.method == methods[0]]
    asked, wrong = [one for one in here if one.asked], sum(one.outcome == "wrong" for one in here)
    wrongly = f"accepted {wrong or 'none'} of {len(here)} wrongly"
    if not asked:
        return f"No pair here has one right answer; {methods[0]} {wrongly}."
    share = Share.counted([one.outcome == "right" for one in asked])
    low, high = 100 * share.interval.low, 100 * share.interval.high
    return (
        f"{methods[0]} got {share.count} of the {share.of} pairs that have one right answer right, and accepted them "
        f"({100 * share.value:.0f} %, 95 % interval {low:.0f} to {high:.0f} %), and {wrongly}."
    )


def tiles(content: Content) -> list[Tile]:
    """The first method's figures."""
    methods = methods_of(content.answers)
    pairs = len({(one.pair, one.level) for one in content.answers})
    found = [Tile(f"{pairs:,}", "pairs of maps")]
    if not methods:
        return found
    here = [one for one in content.answers if one.method == methods[0]]
    asked = [one for one in here if one.asked]
    if asked:
        right = sum(one.outcome == "right" for one in asked)
        found.append(Tile(f"{100 * right / len(asked):.0f} %", f"right and accepted, of {len(asked)} asked", "good"))
    wrong, missed = (sum(one.outcome == name for one in here) for name in ("wrong", "missed"))
    found.append(Tile(str(wrong), "accepted, but wrong", "bad" if wrong else "good"))
    found.append(Tile(str(missed), "refused, though there is a right answer"))
    moved = _believed(here)
    if moved:
        found.append(Tile(f"{100 * float(np.median(moved)):.1f} cm", "median displacement of accepted answers"))
    seconds = [one.seconds for one in here if one.seconds is not None]
    if seconds:
        found.append(Tile(f"{float(np.median(seconds)):.2f} s", "median processor time of a pair"))
    return found


def method_sheet(answers: tuple[ReportAnswer, ...]) -> Sheet | None:
    """A row a method; None where nothing was merged."""
    methods = methods_of(answers)
    if not methods:
        return None
    columns = [("method", False)] + [
        (name, True)
        for name in (
            "pairs asked",
            "right and accepted",
            "wrong accepts",
            "missed",
            "median [m]",
            "90 % [m]",
            "s a pair",
        )
    ]
    rows = [_row(method, [one for one in answers if one.method == method]) for method in methods]
    caption = (
        "Shares in per cent with Wilson's 95 % interval, wrong accepts of all pairs with the upper end of theirs; "
        "displacements are those of accepted answers."
    )
    return Sheet("Methods", caption, columns, rows)


def _row(method: str, here: Sequence[ReportAnswer]) -> list[str]:
    asked = [one.outcome == "right" for one in here if one.asked]
    moved = _believed(here)
    seconds = [one.seconds for one in here if one.seconds is not None]
    return [
        method,
        str(len(asked)),
        share_text(Share.counted(asked) if asked else None),
        wrong_text(Share.counted([one.outcome == "wrong" for one in here])),
        str(sum(one.outcome == "missed" for one in here)),
        number_text(float(np.median(moved)) if moved else None, 3),
        number_text(float(np.quantile(moved, 0.9)) if moved else None, 3),
        number_text(float(np.median(seconds)) if seconds else None, 2),
    ]


def _believed(here: Sequence[ReportAnswer]) -> list[float]:
    return [one.displacement_m for one in here if one.accepted and one.displacement_m is not None]
