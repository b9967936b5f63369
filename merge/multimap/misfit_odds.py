"""Probability of an alignment of two clusters, from how well the walls then fit."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, log_expit

from merge.multimap.bridge import Bridge

LEAST_JOINED = 20
"""Pairs that must have joined before their misfits say how well right alignments fit."""

MEDIAN_MISFIT = 1.3
"""Median misfit of right alignments of clusters, as a multiple of that of pairs, which were refined after they joined;
measured on 52 of four drawn buildings (house, hospital, office, thesis floor)."""

LEAST_QUARTILE = math.log(1.4)
"""Least distance of a quartile of the logarithm of right misfits from their median."""

LEAST_TAIL = 5
"""Values in the lowest tenth of a sample from which on a tail is fitted to them."""

LEAST_PROBABILITY = 2.0 / 3.0
"""Clusters are joined by an alignment of at least this probability."""


@dataclass(frozen=True, eq=False)
class MisfitOdds:
    """Probability that two clusters are aligned right, from how well all their walls then fit.

    ``right`` (R,) are misfits of right alignments, ``wrong`` (W,) of wrong ones, and ``prior`` the log-odds of an
    alignment before. They change by the share of right ones that fit no better, divided by that of wrong ones that fit
    no worse. The former is that of a log-logistic distribution as wide as ``right``, since some clusters are bent and
    fit badly in the right place too; the latter that of a Pareto distribution fitted to the tenth that fits best (Hill
    1975). Where little is compared wrong ones fit well more often; so no alignment is likely that compares less than
    ``least_length`` [wide cells].
    """

    right: NDArray[np.float64]
    wrong: NDArray[np.float64]
    least_length: float
    prior: float

    def probability(self, bridge: Bridge) -> float:
        """Return the probability that an alignment is right; it falls with the misfit."""
        return float(expit(self.log_odds(bridge)))

    def log_odds(self, bridge: Bridge) -> float:
        """Return the log-odds of an alignment; none is likely that compares little, or if too few pairs joined."""
        enough = bridge.length >= self.least_length and bridge.misfit < math.inf
        return self.log_odds_of(bridge.misfit) if enough and len(self.right) >= LEAST_JOINED else -math.inf

    def log_odds_of(self, misfit: float) -> float:
        """Return the log-odds of a misfit, whatever is compared."""
        low, middle, high = np.log(np.quantile(self.right, (0.25, 0.5, 0.75)))
        quartile = max((high - low) / 2.0, LEAST_QUARTILE)
        no_better = float(log_expit(math.log(3.0) * (math.log(MEDIAN_MISFIT / misfit) + middle) / quartile))
        return self.prior + no_better - _log_share_below(self.wrong, misfit)


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
