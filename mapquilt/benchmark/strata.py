"""Strata: groups of pairs whose results are aggregated together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mapquilt.evaluation.evaluated_pair import EvaluatedPair

OVERLAPS = ((0.3, "overlap 30 % and more"), (0.15, "overlap 15 to 30 %"), (-1.0, "overlap under 15 %"))
"""Lower bounds of the classes of overlap."""

OVERLAP_UNKNOWN = "overlap unknown"


@dataclass(frozen=True)
class Stratum:
    """One method's answers under a name. ``has_truth`` is False if there is no one transform to find."""

    group: str
    name: str
    pairs: tuple[EvaluatedPair, ...]
    has_truth: bool = True


def strata(pairs: Sequence[EvaluatedPair]) -> list[Stratum]:
    """Build all strata that hold a pair, in the order of the table.

    Pairs that are not identifiable, and those without a reliable truth, have strata of their own: they count in no
    other but the last, which holds every pair; distorted pairs also count in a comparison of poses, which cause them.
    """
    positive = [one for one in pairs if not one.negative]
    sound = [one for one in positive if one.identifiable and one.reliable]
    ambiguous = [one for one in positive if not one.identifiable]
    distorted = [one for one in positive if one.identifiable and not one.reliable]
    negative = [one for one in pairs if one.negative]
    found = [
        *_whole("positives", "all", sound),
        *_split("positives", sound, overlap_class),
        *_split("not identifiable", ambiguous, overlap_class, has_truth=False),
        *_whole("distorted", "all", distorted),
        *_split("noise", sound, lambda one: None if one.pair.noise is None else f"noise {one.pair.noise:g}"),
        *_split("poses", [one for one in positive if one.identifiable], lambda one: one.pair.poses, least=2),
        *_split("world", sound, lambda one: one.pair.world),
        *_split("subset", sound, lambda one: one.pair.subset),
        *_split("set", sound, lambda one: one.pair.suite, least=2),
        *_whole("negatives", "all", negative, has_truth=False),
        *_split("negatives", negative, lambda one: one.pair.subset, least=2, has_truth=False),
    ]
    return [*found, Stratum("every pair", "all", tuple(pairs), has_truth=False)]


def overlap_class(one: EvaluatedPair) -> str:
    """Name the class of overlap of a pair."""
    overlap = one.truth.overlap
    if overlap is None:
        return OVERLAP_UNKNOWN
    return next(name for low, name in OVERLAPS if overlap >= low)


def _whole(group: str, name: str, pairs: list[EvaluatedPair], has_truth: bool = True) -> list[Stratum]:
    return [Stratum(group, name, tuple(pairs), has_truth)] if pairs else []


def _split(
    group: str,
    pairs: list[EvaluatedPair],
    key: Callable[[EvaluatedPair], str | None],
    least: int = 1,
    has_truth: bool = True,
) -> list[Stratum]:
    names = sorted({name for one in pairs if (name := key(one)) is not None}, key=_order)
    if len(names) < least:
        return []
    return [Stratum(group, name, tuple(one for one in pairs if key(one) == name), has_truth) for name in names]


def _order(name: str) -> tuple[int, str]:
    classes = [overlap for _, overlap in OVERLAPS]
    return (classes.index(name) if name in classes else len(classes), name)
