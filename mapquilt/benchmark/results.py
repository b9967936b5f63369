"""Results of a benchmark: answers, their aggregates by stratum, times and calibration."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any

import numpy as np

from mapping.geometry.similarity2 import Similarity2
from mapping.seeds import Role, stream
from mapquilt.benchmark.comparison import Comparison, compare
from mapquilt.benchmark.exchange.answers import ANSWERED
from mapquilt.benchmark.strata import Stratum, strata
from mapquilt.evaluation.aggregation import Aggregate, aggregate
from mapquilt.evaluation.calibration import Calibration, calibration
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, GroundTruth, PairInfo
from mapquilt.evaluation.statistics import Interval, ratio_of_medians
from merge.records.evidence import Evidence
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
    """``answers`` run method after method; ``sets`` are those of their pairs. A score as published is no probability,
    so that it is not calibrated."""

    methods: tuple[str, ...]
    sets: tuple[str, ...]
    answers: Sequence[EvaluatedPair]
    strata: tuple[StratumResult, ...]
    comparisons: tuple[Comparison, ...]
    calibrations: tuple[Calibration, ...]


def build_results(answers: Sequence[EvaluatedPair], seed: int) -> BenchmarkResults:
    """Aggregate answers by stratum and method. Every method must have answered the same pairs in the same order.

    ``answers`` are iterated once, and may be read from a file: only what is counted stays in memory meanwhile.
    """
    by_method = _counted_by_method(answers)
    methods = tuple(by_method)
    by_stratum = zip(*(strata(found) for found in by_method.values()), strict=True)
    results = [
        _stratum_result(stratum, dict(zip(methods, together, strict=True)).get(REFERENCE), method, seed)
        for together in by_stratum
        for method, stratum in zip(methods, together, strict=True)
    ]
    calibrated = [calibration(found) for method, found in by_method.items() if not method.endswith(PUBLISHED)]
    return BenchmarkResults(
        methods=methods,
        sets=tuple(sorted({one.pair.suite for found in by_method.values() for one in found})),
        answers=answers,
        strata=tuple(results),
        comparisons=compare(by_method, seed),
        calibrations=tuple(found for found in calibrated if found is not None),
    )


_NOT_COUNTED: dict[str, Any] = {
    field.name: math.nan if field.type == "float" else None
    for field in fields(Evidence)
    if field.name not in ("acceptance_index", "votes")
}
"""Evidence that no statistic counts."""


def _counted_by_method(answers: Iterable[EvaluatedPair]) -> dict[str, list[EvaluatedPair]]:
    """Group answers by method, without what no statistic counts. The answers to a pair share its record and truth."""
    by_method: dict[str, list[EvaluatedPair]] = {}
    first: list[EvaluatedPair] = []
    for one in answers:
        found = by_method.setdefault(one.method, [])
        if len(by_method) == 1:
            counted = _counted(one, _identity(one.pair), _relation(one.truth))
            first.append(counted)
        else:
            same = first[len(found)]
            counted = _counted(one, same.pair, same.truth)
        found.append(counted)
    return by_method


def _counted(one: EvaluatedPair, pair: PairInfo, truth: GroundTruth) -> EvaluatedPair:
    evidence = None if one.evidence is None else replace(one.evidence, **_NOT_COUNTED)
    return replace(one, pair=pair, truth=truth, reason=None, answer=None, alternative=None, evidence=evidence)


def _identity(pair: PairInfo) -> PairInfo:
    """Leave out the files, and hold equal texts of different pairs once."""
    texts: dict[str, Any] = {
        name: sys.intern(text)
        for name in ("target", "source", "suite", "subset", "world", "poses", "mission", "geometry")
        if (text := getattr(pair, name)) is not None
    }
    return replace(pair, **texts, target_file=None, source_file=None)


def _relation(truth: GroundTruth) -> GroundTruth:
    """Keep if there is a true transform; statistics count its error alone."""
    return truth if truth.target_from_source is None else replace(truth, target_from_source=Similarity2.identity())


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
