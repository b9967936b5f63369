"""Whether one method is better than another, on the same pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from mapping.seeds import Role, stream
from mapquilt.evaluation.statistics import LEVEL, RESAMPLES, Interval
from mapquilt.study.counting import asked
from mapquilt.study.plan import Level, StudyPlan
from mapquilt.study.trial import PairTrial

SIGNIFICANT = 1.0 - LEVEL
ALL_LEVELS = ("all levels",)


@dataclass(frozen=True)
class PairedTest:
    """``method`` against ``other`` at a level, on pairs that both were asked: pairs that one alone had right and
    accepted, ``p`` of McNemar's exact test, ``p_holm`` the same after Holm's correction for all tests of the study,
    the ``difference`` of the shares and its interval by a bootstrap over missions, None with one mission.

    ``verdict`` is better or worse only where ``p_holm`` is below 0.05 and the interval leaves out 0: the first knows
    nothing of missions, the second little of small numbers.
    """

    level: Level
    method: str
    other: str
    pairs: int
    method_alone: int
    other_alone: int
    difference: float
    interval: Interval | None
    p: float
    p_holm: float

    @property
    def verdict(self) -> str:
        if self.p_holm >= SIGNIFICANT or (self.interval is not None and self.interval.low <= 0.0 <= self.interval.high):
            return "no difference shown"
        return "better" if self.difference > 0.0 else "worse"


def paired_tests(plan: StudyPlan, pairs: Sequence[PairTrial]) -> tuple[PairedTest, ...]:
    """Each two methods at each level, and over all levels together.

    Sources: McNemar 1947, exact by the binomial distribution; Holm 1979; for the bootstrap see
    ``over_clusters``.
    """
    sought = asked(plan, pairs)
    found = []
    for level in (*plan.levels, ALL_LEVELS):
        for method, other in combinations([method.title for method in plan.methods], 2):
            here = [trial for trial in sought if level in (trial.level, ALL_LEVELS)]
            test = _test(plan, level, method, other, here)
            if test is not None:
                found.append(test)
    return _corrected(found)


def _test(plan: StudyPlan, level: Level, method: str, other: str, trials: Sequence[PairTrial]) -> PairedTest | None:
    hits = {name: {_key(t): t.right and t.accepted for t in trials if t.method == name} for name in (method, other)}
    keys = sorted(hits[method].keys() & hits[other].keys())
    if not keys:
        return None
    gains = np.array([int(hits[method][key]) - int(hits[other][key]) for key in keys])
    alone, other_alone = int((gains > 0).sum()), int((gains < 0).sum())
    rng = stream(plan.seed, Role.BENCHMARK_BOOTSTRAP, 4)
    interval = _over_missions(gains, [key[0] for key in keys], rng)
    p = mcnemar(alone, other_alone)
    return PairedTest(level, method, other, len(keys), alone, other_alone, float(gains.mean()), interval, p, p)


def _key(trial: PairTrial) -> tuple[str, Level, str, str]:
    return trial.mission, trial.level, trial.target, trial.source


def mcnemar(one_alone: int, other_alone: int) -> float:
    """The chance of a split at least as uneven if both were equally good; 1 where they never differ."""
    from scipy.stats import binomtest

    if not one_alone + other_alone:
        return 1.0
    return float(binomtest(one_alone, one_alone + other_alone).pvalue)


def _over_missions(gains: NDArray[np.int64], missions: Sequence[str], rng: np.random.Generator) -> Interval | None:
    names = sorted(set(missions))
    if len(names) < 2:
        return None
    index = np.array([names.index(mission) for mission in missions])
    sums, sizes = np.bincount(index, weights=gains), np.bincount(index)
    drawn = rng.integers(0, len(names), (RESAMPLES, len(names)))
    shares = sums[drawn].sum(axis=1) / sizes[drawn].sum(axis=1)
    low, high = np.quantile(shares, (SIGNIFICANT / 2.0, 1.0 - SIGNIFICANT / 2.0))
    return Interval(float(low), float(high))


def _corrected(tests: list[PairedTest]) -> tuple[PairedTest, ...]:
    """Holm's step-down: the k-th smallest of n chances times n - k + 1, never falling."""
    order = sorted(range(len(tests)), key=lambda k: tests[k].p)
    least, adjusted = 0.0, {}
    for rank, k in enumerate(order):
        least = max(least, min(1.0, (len(tests) - rank) * tests[k].p))
        adjusted[k] = least
    return tuple(replace(test, p_holm=adjusted[k]) for k, test in enumerate(tests))
