"""What was recorded against what is now."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Literal

from tests.regression.verdict import Verdict

FACTOR = 2.0
"""An error may grow by so much ..."""
FLOORS = {"rotation_deg": 0.1, "scale_percent": 0.2, "displacement_cells": 0.5}
"""... and by this: below it, errors of the best answers come and go with rounding."""

Kind = Literal["worse", "sample changed", "set changed", "better", "other"]
FAILING: tuple[Kind, ...] = ("worse", "sample changed", "set changed")
HEADINGS: Mapping[Kind, str] = {
    "worse": "The merge got worse",
    "sample changed": "The sample is another one: maps are generated otherwise, and its merge says nothing",
    "set changed": "The set of pairs is another one",
    "better": "The merge got better",
    "other": "Changed, within what is allowed",
}


@dataclass(frozen=True)
class Change:
    """What became of one pair, in words; ``kind`` says whether that is a regression."""

    family: str
    pair: str
    kind: Kind
    words: str


def compare(family: str, golden: Mapping[str, Verdict], now: Mapping[str, Verdict]) -> list[Change]:
    """All changes of a family. What was right must stay right, what was refused must stay refused unless it is right
    now, and errors of right answers stay within ``FACTOR`` and ``FLOORS``."""
    changes = []
    for name in [*golden, *(name for name in now if name not in golden)]:
        if name not in now or name not in golden:
            words = "is gone" if name not in now else f"is new: {now[name].outcome}"
            changes.append(Change(family, name, "set changed", words))
        elif golden[name].sample != now[name].sample:
            words = f"{golden[name].sample} -> {now[name].sample}; {_outcomes(golden[name], now[name])}"
            changes.append(Change(family, name, "sample changed", words))
        else:
            changes += _merge_changes(family, golden[name], now[name])
    return changes


def _merge_changes(family: str, before: Verdict, now: Verdict) -> list[Change]:
    if before.outcome != now.outcome:
        worse = before.outcome == "right" or now.outcome == "wrong"
        words = _outcomes(before, now) + (f" ({now.reason})" if now.reason else _errors(now))
        return [Change(family, now.name, "worse" if worse else "better", words)]
    grown = [name for name in FLOORS if before.outcome == "right" and _grew(name, before, now)]
    if grown:
        words = "; ".join(f"{name} {getattr(before, name):g} -> {getattr(now, name):g}" for name in grown)
        return [Change(family, now.name, "worse", f"still right, but {words}")]
    changed = [field.name for field in fields(Verdict) if getattr(before, field.name) != getattr(now, field.name)]
    if changed:
        words = "; ".join(f"{name} {getattr(before, name)} -> {getattr(now, name)}" for name in changed)
        return [Change(family, now.name, "other", f"{now.outcome}; {words}")]
    return []


def _outcomes(before: Verdict, now: Verdict) -> str:
    if before.outcome == now.outcome:
        return f"{now.outcome} as before"
    return f"{before.outcome} -> {now.outcome}, confidence {before.confidence:.2f} -> {now.confidence:.2f}"


def _errors(verdict: Verdict) -> str:
    if verdict.rotation_deg is None or verdict.scale_percent is None or verdict.displacement_cells is None:
        return ""
    return (
        f" (off by {verdict.rotation_deg:.2f} deg, {verdict.scale_percent:.2f} %, "
        f"{verdict.displacement_cells:.1f} cells)"
    )


def _grew(name: str, before: Verdict, now: Verdict) -> bool:
    old, new = getattr(before, name), getattr(now, name)
    return new is not None and old is not None and new > FACTOR * old + FLOORS[name]
