"""A few of many pairs."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mapquilt.benchmark.pair import BenchmarkPair


def even_sample(pairs: Sequence[BenchmarkPair], number: int, rng: np.random.Generator) -> list[BenchmarkPair]:
    """About equal shares of every stratum, in the order of ``pairs``; all where there are no more than ``number``.

    Systematic sampling (Madow and Madow 1944): pairs sorted by stratum are taken at equal steps from a random start.
    Raises ``ValueError`` where ``number`` is not positive.
    """
    if number < 1:
        raise ValueError(f"--limit {number}: must be at least 1")
    if number >= len(pairs):
        return list(pairs)
    by_stratum = sorted(range(len(pairs)), key=lambda index: (_stratum(pairs[index]), index))
    steps = (np.arange(number) + rng.random()) * (len(pairs) / number)
    return [pairs[index] for index in sorted(by_stratum[math.floor(step)] for step in steps.tolist())]


def _stratum(pair: BenchmarkPair) -> tuple[str, bool, str, str, bool, float]:
    return (
        pair.suite,
        pair.truth is None,
        pair.subset or "",
        pair.world or "",
        pair.identifiable,
        pair.overlap or 0.0,
    )
