"""Step 5.2, first half: find the direction of the walls."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from merge.literature.chen2021.binarisation import WALL, Image

QUARTER_DEG = 90.0
STEP_DEG, FINE_STEP_DEG, FINE_REACH_DEG = 0.5, 0.1, 2.0
BESIDE_DEG = 5.0
"""What lies nearer to the maximum is its own slope, and no other direction."""

MOST_PIXELS = 40_000
"""Pictures of more wall are halved first."""

LEAST_SHARPNESS, LEAST_CONTRAST = 0.4, 0.2
"""Houses and halls have a sharpness of 0.5 to 0.9 and a contrast of 0.45 and more; caves and trees below 0.3 and 0.1, a
trapezoid with sides 9 degrees off 0.3, white noise a contrast of 0.06."""


@dataclass(frozen=True, eq=False)
class MainDirection:
    """One of the two perpendicular directions of the walls.

    - ``angle`` [rad], -pi/4 to pi/4, from u to v of the picture (v down);
    - ``sharpness``, 0 to 1: height of the maximum over the best other direction, as a share of its height over the
      median;
    - ``contrast``: height of the maximum over the median, as a share of itself;
    - ``energies`` (180,): of directions 0 to 90 degrees in steps of half a degree, as a share of the greatest.
    """

    angle: float
    sharpness: float
    contrast: float
    energies: NDArray[np.float64]

    @property
    def clear(self) -> bool:
        """True if the building has a main direction."""
        return self.sharpness >= LEAST_SHARPNESS and self.contrast >= LEAST_CONTRAST


def main_direction(walls: Image) -> MainDirection:
    """Find the direction in which projections of the walls are sharpest; sharpness 0 without walls.

    Source: Chen 2021, section 5.2, by the Radon transform. Two things differ. The greatest value of the transform is on
    the diagonal of a thick wall; the sum of squares of a projection is greatest along its side (as in Carpin 2008,
    equation 1). And walls at right angles count together, because the rotation is sought modulo 90 degrees. Only wall
    pixels are projected, first by half degrees, then around the maximum by tenths; the centroid of the peak is the
    result.
    """
    angles = np.arange(0.0, QUARTER_DEG, STEP_DEG)
    points = _points(walls)
    if len(points) < 2:
        return MainDirection(0.0, 0.0, 0.0, np.zeros(len(angles)))
    energies = _folded(points, angles)
    rough = angles[int(np.argmax(energies))]
    best = rough + _centre_of_peak(points, rough)
    energies = energies / energies.max()
    sharpness, contrast = _sharpness(energies, angles, rough), 1.0 - float(np.median(energies))
    angle = (best + QUARTER_DEG / 2.0) % QUARTER_DEG - QUARTER_DEG / 2.0  # the least turn of four
    return MainDirection(math.radians(angle), sharpness, contrast, energies)


def _points(walls: Image) -> NDArray[np.float64]:
    while np.count_nonzero(walls) > MOST_PIXELS:
        halved = cv2.resize(walls, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        walls = np.where(halved > 0, WALL, 0).astype(np.uint8)
    rows, cols = np.nonzero(walls)
    return np.stack((cols, rows), axis=-1).astype(np.float64)


def _folded(points: NDArray[np.float64], angles_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Add the energy (N,) of each direction and of the one at right angles to it."""
    angles = np.radians(angles_deg)
    centred = points - points.mean(axis=0)
    return np.asarray(projected(centred, angles) + projected(centred, angles + math.pi / 2.0))


@njit(cache=True)
def projected(points: NDArray[np.float64], angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sum the squares (N,) of the projection of ``points`` (M, 2), in pixels, along each of the directions.

    A point is shared by the two nearest bins of one pixel, and bins are smoothed by 1-2-1; otherwise the lattice of
    pixels would show at 0 and 45 degrees.
    """
    reach = math.ceil(np.sqrt((points**2).sum(axis=1).max())) + 3
    energies = np.zeros(len(angles))
    for k in range(len(angles)):
        c, s = math.cos(angles[k]), math.sin(angles[k])
        bins = np.zeros(2 * reach + 2)
        for i in range(len(points)):
            place = points[i, 1] * c - points[i, 0] * s + reach
            lower = int(place)
            share = place - lower
            bins[lower] += 1.0 - share
            bins[lower + 1] += share
        for b in range(1, len(bins) - 1):
            smooth = (bins[b - 1] + 2.0 * bins[b] + bins[b + 1]) / 4.0
            energies[k] += smooth * smooth
    return energies


def _centre_of_peak(points: NDArray[np.float64], rough_deg: float) -> float:
    """Return the offset [degrees] of the centroid of the peak, which is less affected by pixels than its top."""
    off = np.arange(-FINE_REACH_DEG, FINE_REACH_DEG + FINE_STEP_DEG / 2.0, FINE_STEP_DEG)
    energies = _folded(points, rough_deg + off)
    weights = np.maximum(energies - max(energies[0], energies[-1]), 0.0)
    return float((weights * off).sum() / weights.sum()) if weights.sum() > 0.0 else 0.0


def _sharpness(energies: NDArray[np.float64], angles_deg: NDArray[np.float64], best_deg: float) -> float:
    """Return 1 less the height of the best other direction over that of the best, both above the median."""
    off = np.abs(angles_deg - best_deg)
    apart = np.minimum(off, QUARTER_DEG - off) > BESIDE_DEG
    heights = energies - np.median(energies)
    highest = float(heights.max())
    return 1.0 - max(0.0, float(heights[apart].max())) / highest if highest > 0.0 else 0.0
