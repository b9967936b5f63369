"""Which trials are counted together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mapquilt.benchmark.trial import Trial

OVERLAPS = ((0.3, "overlap 30 % and more"), (0.15, "overlap 15 to 30 %"), (-1.0, "overlap under 15 %"))
"""Lower bounds of the classes of overlap."""

OVERLAP_UNTOLD = "overlap not told"


@dataclass(frozen=True)
class Stratum:
    """Trials under a name. ``has_truth`` is False where there is nothing to be right about."""

    group: str
    name: str
    trials: tuple[Trial, ...]
    has_truth: bool = True


def strata(trials: Sequence[Trial]) -> list[Stratum]:
    """All strata that hold a trial, in the order of the table.

    Pairs that are not identifiable, and bent ones, are reported apart: they count in no other stratum but the last,
    which holds every pair. Wherever a pair is counted, an accepted wrong answer is a wrong accept.
    """
    sound = [trial for trial in trials if trial.sound]
    apart = [trial for trial in trials if not trial.negative and not trial.pair.identifiable]
    bent = [trial for trial in trials if trial.pair.identifiable and trial.bent]
    negative = [trial for trial in trials if trial.negative]
    found = [
        *_whole("positives", "all", sound),
        *_split("positives", sound, overlap_class),
        *_split("not identifiable", apart, overlap_class),
        *_whole("bent", "all", bent),
        *_split("noise", sound, lambda trial: None if trial.pair.noise is None else f"noise {trial.pair.noise:g}"),
        *_split("world", sound, lambda trial: trial.pair.world),
        *_split("subset", sound, lambda trial: trial.pair.subset),
        *_split("set", sound, lambda trial: trial.pair.suite, least=2),
        *_whole("negatives", "all", negative, has_truth=False),
        *_split("negatives", negative, lambda trial: trial.pair.subset, least=2, has_truth=False),
    ]
    return [*found, Stratum("every pair", "all", tuple(trials), has_truth=False)]


def overlap_class(trial: Trial) -> str:
    """The class of overlap that a trial's pair lies in."""
    overlap = trial.pair.overlap
    if overlap is None:
        return OVERLAP_UNTOLD
    return next(name for low, name in OVERLAPS if overlap >= low)


def _whole(group: str, name: str, trials: list[Trial], has_truth: bool = True) -> list[Stratum]:
    return [Stratum(group, name, tuple(trials), has_truth)] if trials else []


def _split(
    group: str, trials: list[Trial], key: Callable[[Trial], str | None], least: int = 1, has_truth: bool = True
) -> list[Stratum]:
    names = sorted({name for trial in trials if (name := key(trial)) is not None}, key=_order)
    if len(names) < least:
        return []
    return [Stratum(group, name, tuple(t for t in trials if key(t) == name), has_truth) for name in names]


def _order(name: str) -> tuple[int, str]:
    classes = [overlap for _, overlap in OVERLAPS]
    return (classes.index(name) if name in classes else len(classes), name)
