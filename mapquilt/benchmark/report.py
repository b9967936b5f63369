"""What a benchmark found: trials, counts, times and calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mapquilt.benchmark.strata import strata
from mapquilt.benchmark.trial import Trial
from mapquilt.evaluation.aggregation import Tally, Timing, tally, timing
from mapquilt.evaluation.calibration import Calibration, calibration
from merge.settings import MergeSettings


@dataclass(frozen=True)
class Report:
    """Tallies and timings go together, one a stratum and method. Calibration is told of answers of the common judge,
    whose confidence is meant as a probability; a method's own score as published is not."""

    methods: tuple[MergeSettings, ...]
    seed: int
    trials: tuple[Trial, ...]
    tallies: tuple[Tally, ...]
    timings: tuple[Timing, ...]
    calibrations: tuple[Calibration, ...]


def build_report(methods: tuple[MergeSettings, ...], seed: int, trials: Sequence[Trial]) -> Report:
    """Count, time and calibrate."""
    cells = [(stratum, method) for stratum in strata(trials) for method in range(len(methods))]
    told = [calibration(trials, k) for k, settings in enumerate(methods) if not settings.as_published]
    return Report(
        methods,
        seed,
        tuple(trials),
        tuple(tally(stratum, method, seed) for stratum, method in cells),
        tuple(timing(stratum, method, seed) for stratum, method in cells),
        tuple(found for found in told if found is not None),
    )
