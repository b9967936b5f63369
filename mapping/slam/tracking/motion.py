"""Prediction by odometry, and the level of its noise as the matched scans show it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.slam.settings import MotionSettings

LEAST_VARIANCE = np.array([1e-6, 1e-6, 1e-7])
"""Variance of a standing robot [m^2, m^2, rad^2]."""

CHI_SQUARED_MEDIAN = 0.4549
"""Median of the chi-squared distribution with one degree of freedom."""


def motion_covariance(distance: float, turn: float, settings: MotionSettings) -> NDArray[np.float64]:
    """Return the covariance (3, 3) of a motion in the robot's frame at level 1, ``distance`` [m] and ``turn`` [rad]
    being the lengths of its path and of all its turns."""
    along = settings.translation_from_translation**2 * distance + settings.translation_from_rotation**2 * turn
    yaw = settings.rotation_from_rotation**2 * turn + settings.rotation_from_translation**2 * distance
    across = along / 4.0 + yaw * distance**2 / 3.0
    return np.diag(np.array([along, across, yaw]) + LEAST_VARIANCE)


class OdometryLevel:
    """Estimate the factor by which odometry errs more than level 1, from the last differences between odometry and
    matched scans.

    Each difference has the variance ``level^2 predicted + measured``; the level is that at which the median of the
    squared and normalised differences is the one of a chi-squared distribution, which outliers do not move.
    """

    def __init__(self, settings: MotionSettings) -> None:
        self.settings = settings
        self.level = settings.first_level
        self._differences: list[tuple[float, float, float]] = []

    def add(
        self, difference: NDArray[np.float64], predicted: NDArray[np.float64], measured: NDArray[np.float64]
    ) -> None:
        """Take in a difference (3,), its variances at level 1 (3,), and those of the match (3,).

        Wheels hardly slip sideways: the difference across the path shows nothing of the level.
        """
        for axis in (0, 2):
            off, own, match = float(difference[axis]), float(predicted[axis]), float(measured[axis])
            if match < 4.0 * own * self.level**2:
                self._differences.append((off * off, own, match))
        most = 2 * self.settings.window
        if len(self._differences) > most:
            del self._differences[: len(self._differences) - most]
        if len(self._differences) >= most // 4:
            self.level = self._solve()

    def _solve(self) -> float:
        squared, predicted, measured = np.array(self._differences).T
        low, high = self.settings.least_level, self.settings.greatest_level
        for _ in range(20):
            middle = math.sqrt(low * high)
            if np.median(squared / (middle**2 * predicted + measured)) > CHI_SQUARED_MEDIAN:
                low = middle
            else:
                high = middle
        return math.sqrt(low * high)
