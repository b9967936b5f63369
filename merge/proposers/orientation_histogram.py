"""Likely rotations of one map against another, from histograms of their wall orientations."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.validation import require_valid

BINS = 180


@dataclass(frozen=True)
class OrientationSettings:
    """Rotations from orientation histograms.

    - ``smoothing_deg``: standard deviation of the Gaussian that smooths the histogram;
    - ``min_peak_share``: a peak of the correlation counts if it reaches this share of the highest;
    - ``max_peaks``: the best of them are used.
    """

    smoothing_deg: float = 1.5
    min_peak_share: float = 0.45
    max_peaks: int = 4

    def __post_init__(self) -> None:
        require_valid(self, shares=("min_peak_share",))


def orientation_histogram(
    normals: NDArray[np.float64], settings: OrientationSettings = OrientationSettings()
) -> NDArray[np.float64]:
    """Count wall normals by direction modulo 180 degrees, in bins of 1 degree (180,).

    Root of the count, smoothed, mean removed, of length 1; zeros without walls. The root keeps one long wall from
    dominating. ``normals`` (N, 2) are unit vectors or zero.
    """
    oriented = normals[normals.any(axis=1)]
    degrees = np.degrees(np.arctan2(oriented[:, 1], oriented[:, 0])) % BINS
    counts = np.bincount(np.minimum(degrees.astype(int), BINS - 1), minlength=BINS).astype(np.float64)
    waves = np.arange(BINS // 2 + 1)
    blur = np.exp(-0.5 * (math.tau / BINS * waves * settings.smoothing_deg) ** 2)
    smooth = np.fft.irfft(np.fft.rfft(counts) * blur, BINS)
    histogram = np.sqrt(np.maximum(smooth, 0.0))
    histogram -= histogram.mean()
    length = float(np.linalg.norm(histogram))
    return histogram / length if length > 0.0 else histogram


def correlate_histograms(target: NDArray[np.float64], source: NDArray[np.float64]) -> NDArray[np.float64]:
    """Correlate two orientation histograms circularly: -1 to 1 (180,), by degrees that the source is rotated."""
    return np.fft.irfft(np.fft.rfft(target) * np.fft.rfft(source).conj(), BINS)


def likely_yaws(
    target: NDArray[np.float64], source: NDArray[np.float64], settings: OrientationSettings = OrientationSettings()
) -> list[float]:
    """List the yaws [rad] that make walls parallel, best first; empty if no orientations correlate.

    Each comes with its opposite, because the histogram does not distinguish front and back.
    """
    values = correlate_histograms(target, source)
    before, after = np.roll(values, 1), np.roll(values, -1)
    least = max(1e-9, settings.min_peak_share * values.max())
    peaks = np.flatnonzero((values >= before) & (values > after) & (values > least))
    best = peaks[np.argsort(-values[peaks], kind="stable")][: settings.max_peaks]
    bend = before[best] - 2.0 * values[best] + after[best]
    between = np.where(bend < 0.0, 0.5 * (before[best] - after[best]) / np.where(bend < 0.0, bend, 1.0), 0.0)
    return [math.radians(degrees + back) for degrees in best + between for back in (0.0, 180.0)]
