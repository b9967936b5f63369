"""How far a share, or a ratio of medians, may be trusted: 95 % intervals."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

RESAMPLES = 1000
LEVEL = 0.95


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
    def counted(hits: Sequence[bool]) -> Share:
        """Source: Wilson 1927, by SciPy. Raises ``ValueError`` where there is nothing to count."""
        from scipy.stats import binomtest

        if not hits:
            raise ValueError("Share: nothing to count")
        found = binomtest(sum(hits), len(hits)).proportion_ci(LEVEL, method="wilson")
        return Share(sum(hits), len(hits), Interval(float(found.low), float(found.high)))

    @property
    def value(self) -> float:
        return self.count / self.of


def over_clusters(hits: Sequence[bool], clusters: Sequence[Hashable], rng: np.random.Generator) -> Interval | None:
    """Bootstrap interval of a share whose items come in clusters, which are drawn again whole; None with one cluster.

    Source: Davison and Hinkley 1997, section 3.8; percentile method. It knows nothing of what never happened: with no
    hit at all both ends are 0.
    """
    names = list(dict.fromkeys(clusters))
    if len(names) < 2:
        return None
    index = np.array([names.index(cluster) for cluster in clusters])
    counts = np.bincount(index, weights=np.array(hits, dtype=np.float64), minlength=len(names))
    sizes = np.bincount(index, minlength=len(names))
    drawn = rng.integers(0, len(names), (RESAMPLES, len(names)))
    return _percentiles(counts[drawn].sum(axis=1) / sizes[drawn].sum(axis=1))


def ratio_of_medians(
    above: NDArray[np.float64], below: NDArray[np.float64], rng: np.random.Generator
) -> tuple[float, Interval]:
    """median(above) / median(below) of paired values (N,), and its bootstrap interval, pairs being drawn again."""
    drawn = rng.integers(0, len(above), (RESAMPLES, len(above)))
    ratios = np.median(above[drawn], axis=1) / np.median(below[drawn], axis=1)
    return float(np.median(above) / np.median(below)), _percentiles(ratios)


def ratio_of_medians_over_clusters(
    above: Sequence[Sequence[float]], below: Sequence[Sequence[float]], rng: np.random.Generator
) -> tuple[float, Interval]:
    """median(above) / median(below) of values that come in clusters, and its interval by a bootstrap that draws those
    again whole."""

    def ratio(drawn: Sequence[int]) -> float:
        over, under = (np.concatenate([values[k] for k in drawn]) for values in (above, below))
        return float(np.median(over) / np.median(under))

    ratios = [ratio(drawn) for drawn in rng.integers(0, len(above), (RESAMPLES, len(above))).tolist()]
    return ratio(range(len(above))), _percentiles(np.array(ratios))


def _percentiles(values: NDArray[np.float64]) -> Interval:
    low, high = np.quantile(values, ((1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0))
    return Interval(float(low), float(high))
