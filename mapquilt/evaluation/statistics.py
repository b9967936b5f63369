"""Shares, quantiles and ratios with 95 % intervals."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

RESAMPLES = 1000
LEVEL = 0.95
MOST_DRAWN = 2**20
"""Most indices that a bootstrap draws at a time, so that its memory does not grow with the number of values."""


@dataclass(frozen=True)
class Interval:
    low: float
    high: float


@dataclass(frozen=True)
class Share:
    """``count`` of ``of``, with Wilson's interval."""

    count: int
    of: int
    interval: Interval

    @staticmethod
    def counted(flags: Sequence[bool]) -> Share:
        """Count the true ones (Wilson 1927, by SciPy). Raises ``ValueError`` if there is nothing to count."""
        from scipy.stats import binomtest

        if not flags:
            raise ValueError("Share: nothing to count")
        found = binomtest(sum(flags), len(flags)).proportion_ci(LEVEL, method="wilson")
        return Share(sum(flags), len(flags), Interval(float(found.low), float(found.high)))

    @property
    def value(self) -> float:
        return self.count / self.of


@dataclass(frozen=True)
class Quantiles:
    """Median and 90th percentile."""

    median: float
    p90: float

    @staticmethod
    def of(values: Sequence[float]) -> Quantiles:
        median, p90 = np.quantile(values, (0.5, 0.9))
        return Quantiles(float(median), float(p90))


def mean_over_clusters(
    values: Sequence[float], clusters: Sequence[Hashable], rng: np.random.Generator
) -> Interval | None:
    """Bootstrap the mean of values that come in clusters, which are drawn again whole; None with one cluster.

    Flags (True is 1) give the interval of a share. Source: Davison and Hinkley 1997, section 3.8; percentile method.
    The bootstrap cannot extrapolate: without any hit both ends are 0.
    """
    names = list(dict.fromkeys(clusters))
    if len(names) < 2:
        return None
    numbers = {name: number for number, name in enumerate(names)}
    index = np.array([numbers[cluster] for cluster in clusters])
    sums = np.bincount(index, weights=np.array(values, dtype=np.float64), minlength=len(names))
    sizes = np.bincount(index, minlength=len(names))
    means = [sums[drawn].sum(axis=1) / sizes[drawn].sum(axis=1) for drawn in _resamples(len(names), rng)]
    return _percentiles(np.concatenate(means))


def _resamples(values: int, rng: np.random.Generator) -> Iterator[NDArray[np.int64]]:
    """Draw the indices (K, values) of all resamples, a block of them at a time."""
    block = max(1, MOST_DRAWN // values)
    for start in range(0, RESAMPLES, block):
        yield rng.integers(0, values, (min(block, RESAMPLES - start), values))


def ratio_of_medians(
    above: NDArray[np.float64], below: NDArray[np.float64], rng: np.random.Generator
) -> tuple[float, Interval]:
    """Divide the medians of paired values (N,), with a bootstrap interval that draws pairs again."""
    ratios = [
        np.median(above[drawn], axis=1) / np.median(below[drawn], axis=1) for drawn in _resamples(len(above), rng)
    ]
    return float(np.median(above) / np.median(below)), _percentiles(np.concatenate(ratios))


def ratio_of_medians_over_clusters(
    above: Sequence[Sequence[float]], below: Sequence[Sequence[float]], rng: np.random.Generator
) -> tuple[float, Interval]:
    """Divide the medians of values that come in clusters, with a bootstrap interval that draws clusters again."""

    def ratio(drawn: Sequence[int]) -> float:
        over, under = (np.concatenate([values[k] for k in drawn]) for values in (above, below))
        return float(np.median(over) / np.median(under))

    ratios = [ratio(drawn) for drawn in rng.integers(0, len(above), (RESAMPLES, len(above))).tolist()]
    return ratio(range(len(above))), _percentiles(np.array(ratios))


def _percentiles(values: NDArray[np.float64]) -> Interval:
    low, high = np.quantile(values, ((1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0))
    return Interval(float(low), float(high))
