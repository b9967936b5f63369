"""By how much one map may be turned against another, from the directions of their walls alone."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

BINS = 180
SMOOTHING_DEG = 1.5


def wall_directions(normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """How much wall faces each direction modulo 180 degrees, in bins of 1 degree (180,): root of the count, smoothed,
    mean removed, of length 1; zeros without walls. ``normals`` (N, 2) are unit vectors or zero.

    The root keeps one long wall from drowning the rest.
    """
    seen = normals[normals.any(axis=1)]
    degrees = np.degrees(np.arctan2(seen[:, 1], seen[:, 0])) % BINS
    counts = np.bincount(np.minimum(degrees.astype(int), BINS - 1), minlength=BINS).astype(np.float64)
    smooth = np.fft.irfft(np.fft.rfft(counts) * _blur(), BINS)
    histogram = np.sqrt(np.maximum(smooth, 0.0))
    histogram -= histogram.mean()
    length = float(np.linalg.norm(histogram))
    return histogram / length if length > 0.0 else histogram


def _blur() -> NDArray[np.float64]:
    waves = np.arange(BINS // 2 + 1)
    return np.asarray(np.exp(-0.5 * (math.tau / BINS * waves * SMOOTHING_DEG) ** 2))


def correlated(target: NDArray[np.float64], source: NDArray[np.float64]) -> NDArray[np.float64]:
    """The circular correlation (180,) of two ``wall_directions``, by degrees that the source turns: -1 to 1."""
    return np.fft.irfft(np.fft.rfft(target) * np.fft.rfft(source).conj(), BINS)


def likely_yaws(
    target: NDArray[np.float64], source: NDArray[np.float64], floor: float = 0.45, most: int = 4
) -> list[float]:
    """Yaws [rad] that lay walls along walls, best first, each with its opposite (walls do not tell front from back).

    Peaks of the correlation that reach ``floor`` times the highest, at most ``most``; empty where nothing correlates.
    """
    values = correlated(target, source)
    before, after = np.roll(values, 1), np.roll(values, -1)
    peaks = np.flatnonzero((values >= before) & (values > after) & (values > max(1e-9, floor * values.max())))
    best = peaks[np.argsort(-values[peaks], kind="stable")][:most]
    bend = before[best] - 2.0 * values[best] + after[best]
    between = np.where(bend < 0.0, 0.5 * (before[best] - after[best]) / np.where(bend < 0.0, bend, 1.0), 0.0)
    return [math.radians(degrees + back) for degrees in best + between for back in (0.0, 180.0)]
