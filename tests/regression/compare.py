"""Comparison of golden pairs with those of today."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Literal

from tests.regression.golden import GoldenPair

FACTOR = 2.0
"""Largest allowed growth of an error, as a factor, ..."""
FLOORS = {"rotation_deg": 0.1, "scale_percent": 0.2, "displacement_cells": 0.5}
"""... and in addition to it: below these values errors change with rounding."""

Kind = Literal["worse", "sample changed", "set changed", "better", "other"]
FAILING: tuple[Kind, ...] = ("worse", "sample changed", "set changed")
HEADINGS: Mapping[Kind, str] = {
    "worse": "The merge got worse",
    "sample changed": "The sample changed: the maps are generated differently, so their merges cannot be compared",
    "set changed": "The set of pairs changed",
    "better": "The merge got better",
    "other": "Changed within the tolerance",
}


@dataclass(frozen=True)
class Change:
    """Change of one pair, in words; ``kind`` decides if it is a regression."""

    family: str
    pair: str
    kind: Kind
    words: str


def compare(family: str, golden: Mapping[str, GoldenPair], now: Mapping[str, GoldenPair]) -> list[Change]:
    """List all changes of a family.

    A true accept must stay one, a refusal must not become a false accept, and errors of true accepts must stay within
    ``FACTOR`` and ``FLOORS``.
    """
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


def _merge_changes(family: str, before: GoldenPair, now: GoldenPair) -> list[Change]:
    if before.outcome != now.outcome:
        worse = before.outcome == "true accept" or now.outcome == "false accept"
        words = _outcomes(before, now) + (f" ({now.reason})" if now.reason else _errors(now))
        return [Change(family, now.name, "worse" if worse else "better", words)]
    grown = [name for name in FLOORS if before.outcome == "true accept" and _grew(name, before, now)]
    if grown:
        words = "; ".join(f"{name} {getattr(before, name):g} -> {getattr(now, name):g}" for name in grown)
        return [Change(family, now.name, "worse", f"still {now.outcome}, but {words}")]
    changed = [field.name for field in fields(GoldenPair) if getattr(before, field.name) != getattr(now, field.name)]
    if changed:
        words = "; ".join(f"{name} {getattr(before, name)} -> {getattr(now, name)}" for name in changed)
        return [Change(family, now.name, "other", f"{now.outcome}; {words}")]
    return []


def _outcomes(before: GoldenPair, now: GoldenPair) -> str:
    if before.outcome == now.outcome:
        return f"still {now.outcome}"
    return f"{before.outcome} -> {now.outcome}, confidence {before.confidence} -> {now.confidence}"


def _errors(pair: GoldenPair) -> str:
    if pair.rotation_deg is None or pair.scale_percent is None or pair.displacement_cells is None:
        return ""
    return f" (error {pair.rotation_deg:.2f} deg, {pair.scale_percent:.2f} %, {pair.displacement_cells:.1f} cells)"


def _grew(name: str, before: GoldenPair, now: GoldenPair) -> bool:
    old, new = getattr(before, name), getattr(now, name)
    return new is not None and old is not None and new > FACTOR * old + FLOORS[name]
