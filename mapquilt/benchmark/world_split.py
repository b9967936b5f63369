"""Split of pairs between a fit and its check, so that no world is in both."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.evaluation.evaluated_pair import PairInfo

CHECK_SHARE = 1.0 / 3.0
"""Share of the pairs that the check should get: the fit needs more, for its rare wrong answers."""


@dataclass(frozen=True)
class WorldSplit:
    """Pairs of the fit and of the check. ``mixed`` are of two worlds, one of either side, and belong to neither;
    ``check_worlds`` names the worlds kept for the check, empty if it has data sets of its own."""

    fit: tuple[BenchmarkPair, ...]
    check: tuple[BenchmarkPair, ...]
    mixed: tuple[BenchmarkPair, ...] = ()
    check_worlds: tuple[str, ...] = ()


def shown_worlds(pairs: Sequence[PairInfo]) -> list[frozenset[str]]:
    """Name the worlds that each pair shows: its families, joined by a plus, since two missions of a family may share
    their world.

    Where no family is known, those of its missions, joined by a plus, are looked up in the other pairs of its set.
    Without a family a mission is a world of its own, and without a mission the whole set is one.
    """
    family = {(one.suite, one.mission): one.world for one in pairs if one.world and one.mission}
    return [_worlds(one, family) for one in pairs]


def _worlds(one: PairInfo, family: dict[tuple[str, str], str]) -> frozenset[str]:
    if one.world:
        return frozenset(one.world.split("+"))
    missions = one.mission.split("+") if one.mission else []
    named = [family.get((one.suite, name), f"{one.suite}/{name}") for name in missions]
    return frozenset(named or [one.suite])


def with_worlds(pairs: Sequence[BenchmarkPair]) -> list[BenchmarkPair]:
    """State the worlds of each pair, those of two joined by a plus, so that a part of the set still knows them."""
    shown = shown_worlds([pair.info for pair in pairs])
    return [
        replace(pair, info=replace(pair.info, world="+".join(sorted(worlds))))
        for pair, worlds in zip(pairs, shown, strict=True)
    ]


def split_by_world(pairs: Sequence[BenchmarkPair]) -> WorldSplit:
    """Give whole worlds to the fit or to the check, the worlds of most pairs first, each where most pairs lack.

    Raises ``ValueError`` if all pairs show one world.
    """
    shown = shown_worlds([pair.info for pair in pairs])
    counts = Counter(world for worlds in shown for world in worlds)
    if len(counts) < 2:
        raise ValueError(
            f"calibrate: all pairs are of one world, {next(iter(counts), 'none')!r}, the check needs another: name the "
            "world or mission of each pair in its list, or give --check-dataset"
        )
    lacking = {"fit": sum(counts.values()) * (1.0 - CHECK_SHARE), "check": sum(counts.values()) * CHECK_SHARE}
    side = {}
    for world, count in sorted(counts.items(), key=lambda item: (-item[1], item[0])):
        side[world] = max(lacking, key=lambda name: lacking[name])
        lacking[side[world]] -= count
    parts: dict[str, list[BenchmarkPair]] = {"fit": [], "check": [], "mixed": []}
    for pair, worlds in zip(pairs, shown, strict=True):
        sides = {side[world] for world in worlds}
        parts[sides.pop() if len(sides) == 1 else "mixed"].append(pair)
    return WorldSplit(
        fit=tuple(parts["fit"]),
        check=tuple(parts["check"]),
        mixed=tuple(parts["mixed"]),
        check_worlds=tuple(sorted(world for world in side if side[world] == "check")),
    )
