"""Tests of paired outcomes that come in clusters, such as two methods on the same pairs of maps."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence

import numpy as np
from numpy.typing import NDArray

from mapquilt.evaluation.statistics import LEVEL

SIGNIFICANT = 1.0 - LEVEL
POWER = 0.8
"""Chance to find a difference of the size that is called detectable."""


def cluster_sums(gains: Sequence[float] | NDArray[np.float64], clusters: Sequence[Hashable]) -> NDArray[np.float64]:
    """Add up gains (N,) within each cluster, in the order in which clusters come first."""
    numbers = {name: number for number, name in enumerate(dict.fromkeys(clusters))}
    return np.bincount([numbers[cluster] for cluster in clusters], weights=gains).astype(np.float64)


def sign_flip_p(sums: NDArray[np.float64]) -> float:
    """Compute the probability of a total at least as far from 0 if each cluster's whole number had either sign alike.

    Two methods that are equally good may change their names in each cluster, whatever the dependence inside it. The
    distribution of the total is exact, by convolution; with one pair in each cluster this is McNemar's exact test.
    Source: Fisher 1935, section 21; Good 2005, section 3.2.
    """
    sizes = np.rint(np.abs(sums[sums != 0.0])).astype(np.int64)
    chances = np.ones(1)
    for (
        size
    ) in sizes.tolist():  # the index is (total + sum of sizes so far) / 2, since a flip moves the total by 2 size
        moved = np.zeros(len(chances) + size)
        moved[: len(chances)] += 0.5 * chances
        moved[size:] += 0.5 * chances
        chances = moved
    totals = 2 * np.arange(len(chances)) - sizes.sum()
    return float(min(1.0, chances[np.abs(totals) >= abs(sums.sum())].sum()))


def holm(p_values: Sequence[float]) -> tuple[float, ...]:
    """Adjust p-values for their number: the k-th smallest of n times n - k + 1, never falling (Holm 1979)."""
    adjusted, least = [0.0] * len(p_values), 0.0
    for rank, index in enumerate(sorted(range(len(p_values)), key=lambda k: p_values[k])):
        least = max(least, min(1.0, (len(p_values) - rank) * p_values[index]))
        adjusted[index] = least
    return tuple(adjusted)


def detectable_difference(gains: Sequence[int], clusters: Sequence[Hashable], tests: int) -> float | None:
    """Estimate the smallest true mean gain that one of ``tests`` comparisons would find with 80 % power.

    The standard error of the mean is that of clusters (Liang and Zeger 1986), and the level is Bonferroni's, 0.05 /
    ``tests``, since Holm's first step is as strict. None if no difference would be found, or gains add up to something
    in fewer than two clusters, so that nothing is known of their spread.
    """
    from scipy.stats import norm

    if np.count_nonzero(cluster_sums(gains, clusters)) < 2:
        return None
    centred = np.asarray(gains, np.float64) - np.mean(gains)
    sums = cluster_sums(centred, clusters)
    error = math.sqrt(len(sums) / (len(sums) - 1) * float(sums @ sums)) / len(gains)
    found = float(norm.isf(SIGNIFICANT / tests / 2.0) + norm.ppf(POWER)) * error
    return found if found <= 1.0 else None
