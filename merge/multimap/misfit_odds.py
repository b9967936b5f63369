"""Probability of an alignment of two clusters, from how well the walls then fit."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, log_ndtr

from merge.multimap.bridge import Bridge

LEAST_JOINED = 20
"""Pairs that must have joined before their misfits say how well right alignments fit."""

LEAST_SPREAD = 0.5
"""Least standard deviation of the logarithm of the misfit: pairs that joined hold their maps where they fit best."""

QUARTILES = 1.349
"""Distance of the quartiles of a normal distribution [standard deviations]."""

LEAST_TAIL = 5
"""Values in the lowest tenth of a sample from which on a tail is fitted to them."""

LEAST_PROBABILITY = 0.5
"""Clusters are joined by an alignment of at least this probability."""


@dataclass(frozen=True, eq=False)
class MisfitOdds:
    """Probability that two clusters are aligned right, from how well all their walls then fit.

    ``right`` (R,) are misfits of right alignments, ``wrong`` (W,) of wrong ones, and ``prior`` the log-odds of an
    alignment before. They change by the share of right ones that fit no better, divided by that of wrong ones that fit
    no worse. The former is that of a log-normal distribution with the same quartiles, the latter that of a Pareto
    distribution fitted to the tenth that fits best (Hill 1975). Where little is compared wrong ones fit well more
    often; so no alignment is likely that compares less than ``least_length`` [wide cells].
    """

    right: NDArray[np.float64]
    wrong: NDArray[np.float64]
    least_length: float
    prior: float

    def probability(self, bridge: Bridge) -> float:
        """Return the probability that an alignment is right; it falls with the misfit."""
        return float(expit(self.log_odds(bridge)))

    def likely(self, bridges: Iterable[Bridge]) -> list[tuple[Bridge, float]]:
        """List those that are probably right, the most probable first, with their probability."""
        found = [(bridge, self.probability(bridge)) for bridge in bridges]
        return sorted((each for each in found if each[1] > LEAST_PROBABILITY), key=lambda each: -each[1])

    def log_odds(self, bridge: Bridge) -> float:
        """Return the log-odds of an alignment; none is likely that compares little, or if too few pairs joined."""
        if len(self.right) < LEAST_JOINED or bridge.length < self.least_length or not bridge.misfit < math.inf:
            return -math.inf
        low, middle, high = np.log(np.quantile(self.right, (0.25, 0.5, 0.75)))
        spread = max((high - low) / QUARTILES, LEAST_SPREAD)
        no_better = float(log_ndtr((middle - math.log(bridge.misfit)) / spread))
        return self.prior + no_better - _log_share_below(self.wrong, bridge.misfit)


def _log_share_below(sample: NDArray[np.float64], value: float) -> float:
    """Return the logarithm of the share of a sample up to a value; in its lowest tenth that of a Pareto tail.

    The exponent is one standard error less than estimated, and the share no less than a tenth of a value. A sample too
    small for a tail has one value more than seen.
    """
    sample, tail = np.sort(sample), len(sample) // 10
    if tail < LEAST_TAIL or value >= sample[tail]:
        return math.log((1 + int(np.searchsorted(sample, value, side="right"))) / (1 + len(sample)))
    steepness = 1.0 / max(float(np.mean(np.log(sample[tail] / sample[:tail]))), 1e-3)
    steepness *= 1.0 - 1.0 / math.sqrt(tail)
    share = (1 + tail) * (value / float(sample[tail])) ** steepness
    return math.log(max(share, 0.1) / (1 + len(sample)))
