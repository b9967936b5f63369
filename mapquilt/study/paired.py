"""Paired tests: two methods compared on the same pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from mapping.seeds import Role, stream
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.paired_test import SIGNIFICANT, cluster_sums, holm, sign_flip_p
from mapquilt.evaluation.statistics import Interval, mean_over_clusters
from mapquilt.study.plan import Level, StudyPlan

ALL_LEVELS = ("all levels",)


@dataclass(frozen=True)
class PairedTest:
    """``method`` against ``other`` at a level, on the pairs that both were asked for.

    ``method_alone`` and ``other_alone``: true accepts of one method only; ``p``: ``sign_flip_p`` over missions, since
    neither pairs of one mission nor levels of one pair are independent; ``p_holm``: after Holm's correction for all
    tests of the study; ``difference``: of the shares, with its bootstrap ``interval`` over missions, None with one
    mission.
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
        if self.p_holm >= SIGNIFICANT:
            return "no difference shown"
        return "better" if self.difference > 0.0 else "worse"


def paired_tests(plan: StudyPlan, asked: Sequence[EvaluatedPair]) -> tuple[PairedTest, ...]:
    """Compare each two methods at each level, and over all levels together, on the pairs that both were asked for."""
    found = []
    for level in (*plan.levels, ALL_LEVELS):
        here = [one for one in asked if level in (one.pair.level, ALL_LEVELS)]
        for method, other in combinations([method.title for method in plan.methods], 2):
            test = _test(plan, level, method, other, here)
            if test is not None:
                found.append(test)
    adjusted = holm([test.p for test in found])
    return tuple(replace(test, p_holm=p) for test, p in zip(found, adjusted, strict=True))


def _test(plan: StudyPlan, level: Level, method: str, other: str, pairs: Sequence[EvaluatedPair]) -> PairedTest | None:
    hits = {
        name: {_key(one): one.outcome == "true accept" for one in pairs if one.method == name}
        for name in (method, other)
    }
    keys = sorted(hits[method].keys() & hits[other].keys())
    if not keys:
        return None
    gains = [int(hits[method][key]) - int(hits[other][key]) for key in keys]
    missions = [key[0] for key in keys]
    rng = stream(plan.seed, Role.BENCHMARK_BOOTSTRAP, 4)
    p = sign_flip_p(cluster_sums(gains, missions))
    return PairedTest(
        level=level,
        method=method,
        other=other,
        pairs=len(keys),
        method_alone=gains.count(1),
        other_alone=gains.count(-1),
        difference=float(np.mean(gains)),
        interval=mean_over_clusters(gains, missions, rng),
        p=p,
        p_holm=p,
    )


def _key(one: EvaluatedPair) -> tuple[str, Level, str, str]:
    return one.pair.mission or "", one.pair.level, one.pair.target, one.pair.source
