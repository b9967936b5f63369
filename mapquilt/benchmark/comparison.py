"""Comparison of every two methods of a benchmark on the same pairs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from mapping.seeds import Role, stream
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.paired_test import SIGNIFICANT, cluster_sums, detectable_difference, holm, sign_flip_p
from mapquilt.evaluation.statistics import Interval, mean_over_clusters

TRUE_ACCEPTS, FALSE_ACCEPTS = "true accepts", "false accepts"


@dataclass(frozen=True)
class Comparison:
    """``method`` against ``other`` by one outcome, on pairs that both answered.

    - ``outcome``: true accepts, of identifiable pairs with a reliable truth; or false accepts, of every pair;
    - ``pairs``, ``worlds``: their numbers; pairs of one world depend on each other;
    - ``method_alone``, ``other_alone``: number of pairs with this outcome by one method only;
    - ``difference``: of the shares, with its bootstrap ``interval`` over worlds, None with one world;
    - ``p``: by ``sign_flip_p`` over worlds; ``p_holm``: after Holm's correction for all comparisons of the benchmark;
    - ``detectable``: see ``detectable_difference``.
    """

    outcome: str
    method: str
    other: str
    pairs: int
    worlds: int
    method_alone: int
    other_alone: int
    difference: float
    interval: Interval | None
    p: float
    p_holm: float
    detectable: float | None

    @property
    def shown(self) -> bool:
        """True if a difference is shown, at a level of 0.05 for the whole table."""
        return self.p_holm < SIGNIFICANT


def compare(by_method: Mapping[str, Sequence[EvaluatedPair]], seed: int) -> tuple[Comparison, ...]:
    """Compare every two methods, which must have answered the same pairs in the same order, by both outcomes."""
    two = list(combinations(by_method, 2))
    found = []
    for outcome in (TRUE_ACCEPTS, FALSE_ACCEPTS):
        for method, other in two:
            both = zip(by_method[method], by_method[other], strict=True)
            kept = [(one, its) for one, its in both if outcome == FALSE_ACCEPTS or _sound(one)]
            if kept:
                found.append(_comparison(outcome, method, other, kept, 2 * len(two), seed))
    return _corrected(found)


def _sound(one: EvaluatedPair) -> bool:
    return not one.negative and one.identifiable and one.reliable


def _comparison(
    outcome: str,
    method: str,
    other: str,
    answers: Sequence[tuple[EvaluatedPair, EvaluatedPair]],
    tests: int,
    seed: int,
) -> Comparison:
    singular = outcome.removesuffix("s")
    gains = [int(one.outcome == singular) - int(its.outcome == singular) for one, its in answers]
    worlds = [one.pair.cluster or one.pair.title for one, _ in answers]
    sums = cluster_sums(gains, worlds)
    p = sign_flip_p(sums)
    return Comparison(
        outcome=outcome,
        method=method,
        other=other,
        pairs=len(gains),
        worlds=len(sums),
        method_alone=gains.count(1),
        other_alone=gains.count(-1),
        difference=sum(gains) / len(gains),
        interval=mean_over_clusters(gains, worlds, stream(seed, Role.BENCHMARK_BOOTSTRAP, 2)),
        p=p,
        p_holm=p,
        detectable=detectable_difference(gains, worlds, tests),
    )


def _corrected(found: Sequence[Comparison]) -> tuple[Comparison, ...]:
    adjusted = holm([one.p for one in found])
    return tuple(replace(one, p_holm=p) for one, p in zip(found, adjusted, strict=True))
