"""Step 5.2, first half: find the direction of the walls."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.validation import require_valid
from merge.literature.chen2021.wall_picture import WALL, Image

QUARTER_DEG = 90.0


@dataclass(frozen=True)
class DirectionSettings:
    """The search for the main direction.

    - ``step_deg``, ``fine_step_deg``, ``fine_reach_deg``: directions are searched in steps over 90 degrees, then in
      fine steps as far as the reach around the maximum;
    - ``beside_deg``: directions nearer to the maximum are its own slope, and no other direction;
    - ``max_pixels``: pictures of more wall are halved first;
    - ``min_sharpness``, ``min_contrast``: below them a building has no main direction. Houses and halls have a
      sharpness of 0.5 to 0.9 and a contrast of 0.45 and more; caves and trees below 0.3 and 0.1, a trapezoid with sides
      9 degrees off 0.3, white noise a contrast of 0.06.
    """

    step_deg: float = 0.5
    fine_step_deg: float = 0.1
    fine_reach_deg: float = 2.0
    beside_deg: float = 5.0
    max_pixels: int = 40_000
    min_sharpness: float = 0.4
    min_contrast: float = 0.2

    def __post_init__(self) -> None:
        require_valid(self, shares=("min_sharpness", "min_contrast"))


@dataclass(frozen=True, eq=False)
class MainDirection:
    """One of the two perpendicular directions of the walls.

    - ``angle`` [rad], -pi/4 to pi/4, from u to v of the picture (v down);
    - ``sharpness``, 0 to 1: height of the maximum over the best other direction, as a share of its height over the
      median;
    - ``contrast``: height of the maximum over the median, as a share of itself;
    - ``energies`` (N,): of the directions searched, 0 to 90 degrees, as a share of the greatest;
    - ``clear``: True if the building has a main direction.
    """

    angle: float
    sharpness: float
    contrast: float
    energies: NDArray[np.float64]
    clear: bool


def main_direction(walls: Image, settings: DirectionSettings = DirectionSettings()) -> MainDirection:
    """Find the direction in which projections of the walls are sharpest; sharpness 0 without walls.

    Source: Chen 2021, section 5.2, by the Radon transform. Two things differ. The greatest value of the transform is on
    the diagonal of a thick wall; the sum of squares of a projection is greatest along its side (as in Carpin 2008,
    equation 1). And walls at right angles count together, because the rotation is sought modulo 90 degrees. Only wall
    pixels are projected, first coarsely, then finely around the maximum; the centroid of the peak is the
    result.
    """
    angles = np.arange(0.0, QUARTER_DEG, settings.step_deg)
    points = _points(walls, settings.max_pixels)
    if len(points) < 2:
        return MainDirection(0.0, 0.0, 0.0, np.zeros(len(angles)), clear=False)
    energies = _folded(points, angles)
    rough = angles[int(np.argmax(energies))]
    best = rough + _centre_of_peak(points, rough, settings)
    energies = energies / energies.max()
    sharpness, contrast = _sharpness(energies, angles, rough, settings.beside_deg), 1.0 - float(np.median(energies))
    angle = (best + QUARTER_DEG / 2.0) % QUARTER_DEG - QUARTER_DEG / 2.0  # the least turn of four
    clear = sharpness >= settings.min_sharpness and contrast >= settings.min_contrast
    return MainDirection(math.radians(angle), sharpness, contrast, energies, clear)


def _points(walls: Image, max_pixels: int) -> NDArray[np.float64]:
    while np.count_nonzero(walls) > max_pixels:
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


def _centre_of_peak(points: NDArray[np.float64], rough_deg: float, settings: DirectionSettings) -> float:
    """Return the offset [degrees] of the centroid of the peak, which is less affected by pixels than its top."""
    reach, step = settings.fine_reach_deg, settings.fine_step_deg
    off = np.arange(-reach, reach + step / 2.0, step)
    energies = _folded(points, rough_deg + off)
    weights = np.maximum(energies - max(energies[0], energies[-1]), 0.0)
    return float((weights * off).sum() / weights.sum()) if weights.sum() > 0.0 else 0.0


def _sharpness(
    energies: NDArray[np.float64], angles_deg: NDArray[np.float64], best_deg: float, beside_deg: float
) -> float:
    """Return 1 less the height of the best other direction over that of the best, both above the median."""
    off = np.abs(angles_deg - best_deg)
    apart = np.minimum(off, QUARTER_DEG - off) > beside_deg
    heights = energies - np.median(energies)
    highest = float(heights.max())
    return 1.0 - max(0.0, float(heights[apart].max())) / highest if highest > 0.0 else 0.0
