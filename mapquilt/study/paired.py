"""Paired tests: two methods compared on the same pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from mapping.seeds import Role, stream
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.statistics import LEVEL, Interval, mean_over_clusters
from mapquilt.study.plan import Level, StudyPlan

SIGNIFICANT = 1.0 - LEVEL
ALL_LEVELS = ("all levels",)


@dataclass(frozen=True)
class PairedTest:
    """``method`` against ``other`` at a level, on the pairs that both were asked for.

    ``method_alone`` and ``other_alone``: true accepts of one method only; ``p``: McNemar's exact test; ``p_holm``: the
    same after Holm's correction for all tests of the study; ``difference``: of the shares, with its bootstrap
    ``interval`` over missions, None with one mission.

    ``verdict`` is better or worse only if ``p_holm`` is below 0.05 and the interval excludes 0: the test ignores that
    pairs of one mission depend on each other, and the bootstrap is unreliable for small numbers.
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


def paired_tests(plan: StudyPlan, asked: Sequence[EvaluatedPair]) -> tuple[PairedTest, ...]:
    """Compare each two methods at each level, and over all levels together, on the pairs that both were asked for.

    Sources: McNemar 1947, exact by the binomial distribution; Holm 1979; for the bootstrap see
    ``mean_over_clusters``.
    """
    found = []
    for level in (*plan.levels, ALL_LEVELS):
        here = [one for one in asked if level in (one.pair.level, ALL_LEVELS)]
        for method, other in combinations([method.title for method in plan.methods], 2):
            test = _test(plan, level, method, other, here)
            if test is not None:
                found.append(test)
    return _corrected(found)


def _test(plan: StudyPlan, level: Level, method: str, other: str, pairs: Sequence[EvaluatedPair]) -> PairedTest | None:
    hits = {
        name: {_key(one): one.outcome == "true accept" for one in pairs if one.method == name}
        for name in (method, other)
    }
    keys = sorted(hits[method].keys() & hits[other].keys())
    if not keys:
        return None
    gains = np.array([int(hits[method][key]) - int(hits[other][key]) for key in keys])
    alone, other_alone = int((gains > 0).sum()), int((gains < 0).sum())
    rng = stream(plan.seed, Role.BENCHMARK_BOOTSTRAP, 4)
    interval = mean_over_clusters(gains.tolist(), [key[0] for key in keys], rng)
    p = mcnemar(alone, other_alone)
    return PairedTest(level, method, other, len(keys), alone, other_alone, float(gains.mean()), interval, p, p)


def _key(one: EvaluatedPair) -> tuple[str, Level, str, str]:
    return one.pair.mission or "", one.pair.level, one.pair.target, one.pair.source


def mcnemar(one_alone: int, other_alone: int) -> float:
    """Compute the probability of a split at least as uneven if both were equally good; 1 if they never differ."""
    from scipy.stats import binomtest

    if not one_alone + other_alone:
        return 1.0
    return float(binomtest(one_alone, one_alone + other_alone).pvalue)


def _corrected(tests: list[PairedTest]) -> tuple[PairedTest, ...]:
    """Apply Holm's step-down: the k-th smallest of n p-values times n - k + 1, never falling."""
    order = sorted(range(len(tests)), key=lambda k: tests[k].p)
    least, adjusted = 0.0, {}
    for rank, k in enumerate(order):
        least = max(least, min(1.0, (len(tests) - rank) * tests[k].p))
        adjusted[k] = least
    return tuple(replace(test, p_holm=adjusted[k]) for k, test in enumerate(tests))
