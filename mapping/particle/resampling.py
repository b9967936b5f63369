"""Weights of particles, and adaptive resampling."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def normalised_weights(log_weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return weights (N,) that sum to 1."""
    weights = np.exp(log_weights - log_weights.max())
    normalised: NDArray[np.float64] = weights / weights.sum()
    return normalised


def effective_sample_size(weights: NDArray[np.float64]) -> float:
    """Return ``1 / sum(w^2)`` of normalised weights: N if they are equal, 1 if one particle has all.

    Source: Grisetti, Stachniss and Burgard 2007, section III, after Doucet.
    """
    return float(1.0 / (weights**2).sum())


def low_variance_sample(weights: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.int64]:
    """Draw the ancestors (N,) of the next particles with one random number (Probabilistic Robotics, table 4.4).

    A particle of weight w is drawn ``floor(N w)`` or ``ceil(N w)`` times. The result is in increasing order.
    """
    count = len(weights)
    at = (rng.random() + np.arange(count)) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), at, side="right"), count - 1)
