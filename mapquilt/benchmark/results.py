"""Results of a benchmark: answers, their aggregates by stratum, times and calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from mapping.seeds import Role, stream
from mapquilt.benchmark.comparison import Comparison, compare
from mapquilt.benchmark.exchange.answers import ANSWERED
from mapquilt.benchmark.strata import Stratum, strata
from mapquilt.evaluation.aggregation import Aggregate, aggregate
from mapquilt.evaluation.calibration import Calibration, calibration
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.statistics import Interval, ratio_of_medians
from merge.settings import PUBLISHED, MergeSettings

UNIT = "orb"
"""The method whose time alone, without the common verification, is the unit."""

REFERENCE = MergeSettings(UNIT, as_published=True).title
"""The title of that method as it runs alone."""


@dataclass(frozen=True)
class Timing:
    """Median seconds of a method in a stratum, and its ratio to the median of ``REFERENCE`` in the same run; None for
    given answers, whose time was taken elsewhere."""

    median_s: float
    ratio: float | None
    interval: Interval | None


@dataclass(frozen=True)
class StratumResult:
    """One method in one stratum; ``timing`` is None if seconds are unknown."""

    group: str
    stratum: str
    method: str
    aggregate: Aggregate
    timing: Timing | None


@dataclass(frozen=True)
class BenchmarkResults:
    """``answers`` run method after method. A score as published is no probability, so that it is not
    calibrated."""

    methods: tuple[str, ...]
    answers: tuple[EvaluatedPair, ...]
    strata: tuple[StratumResult, ...]
    comparisons: tuple[Comparison, ...]
    calibrations: tuple[Calibration, ...]

    def of_method(self, method: str) -> list[EvaluatedPair]:
        return [one for one in self.answers if one.method == method]


def build_results(answers: Sequence[EvaluatedPair], seed: int) -> BenchmarkResults:
    """Aggregate answers by stratum and method. Every method must have answered the same pairs in the same order."""
    methods = tuple(dict.fromkeys(one.method for one in answers))
    by_method = {method: [one for one in answers if one.method == method] for method in methods}
    by_stratum = zip(*(strata(found) for found in by_method.values()), strict=True)
    results = [
        _stratum_result(stratum, dict(zip(methods, together, strict=True)).get(REFERENCE), method, seed)
        for together in by_stratum
        for method, stratum in zip(methods, together, strict=True)
    ]
    calibrated = [calibration(found) for method, found in by_method.items() if not method.endswith(PUBLISHED)]
    return BenchmarkResults(
        methods=methods,
        answers=tuple(answers),
        strata=tuple(results),
        comparisons=compare(by_method, seed),
        calibrations=tuple(found for found in calibrated if found is not None),
    )


def _stratum_result(stratum: Stratum, reference: Stratum | None, method: str, seed: int) -> StratumResult:
    asked = stratum.pairs if stratum.has_truth else ()
    found = aggregate(stratum.pairs, asked, partial(stream, seed, Role.BENCHMARK_BOOTSTRAP))
    comparable = None if method.endswith(ANSWERED) else reference
    return StratumResult(stratum.group, stratum.name, method, found, _timing(stratum, comparable, seed))


def _timing(stratum: Stratum, reference: Stratum | None, seed: int) -> Timing | None:
    seconds = [one.seconds for one in stratum.pairs if one.seconds is not None]
    if len(seconds) < len(stratum.pairs):
        return None
    unit = [] if reference is None else [one.seconds for one in reference.pairs if one.seconds is not None]
    ratio, interval = None, None
    if len(unit) == len(seconds):
        rng = stream(seed, Role.BENCHMARK_BOOTSTRAP, 1)
        ratio, interval = ratio_of_medians(np.array(seconds), np.array(unit), rng)
    return Timing(float(np.median(seconds)), ratio, interval)
