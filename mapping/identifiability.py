"""Whether a pair has one right answer at all: is there a second place where the true footprints agree as well?

Repeated rooms, shelves and symmetric halls make honest ambiguity: there a refusal is right.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage

from mapping.grid import OccupancyGrid

COARSE_RESOLUTION = 0.2
"""Cell size of the search [m]."""

TOLERANCE = 0.3
"""Walls closer than this agree; walls deeper than this in free space contradict [m]."""

ROTATION_STEP_DEG = 3
NEAR_DISTANCE = 1.0
NEAR_ANGLE_DEG = 10
NEARLY_AS_WELL = 0.9
"""A second placement counts if it is over NEAR_DISTANCE [m] or NEAR_ANGLE_DEG away and reaches this share of the true
placement's agreement."""


@dataclass(frozen=True)
class Identifiability:
    """``agreement`` of the true placement and ``rival`` of the best one elsewhere, both 0 to 1."""

    agreement: float
    rival: float

    @property
    def identifiable(self) -> bool:
        """Whether no second placement agrees nearly as well as the true one."""
        return self.rival < NEARLY_AS_WELL * self.agreement


@dataclass(frozen=True, eq=False)
class _Layers:
    """Walls, the same widened by the tolerance, and deep free space: float32 (rows, cols) at the coarse resolution."""

    walls: NDArray[np.float32]
    wide: NDArray[np.float32]
    free: NDArray[np.float32]

    def cropped(self) -> tuple[_Layers, NDArray[np.float64]]:
        """The part that holds anything, and its first cell's x and y."""
        rows, cols = np.nonzero(self.walls + self.wide + self.free)
        window = np.s_[rows.min() : rows.max() + 1, cols.min() : cols.max() + 1]
        cut = _Layers(self.walls[window], self.wide[window], self.free[window])
        return cut, np.array([cols.min(), rows.min()], np.float64)

    def turned(self, angle: float, centre: NDArray[np.float64], side: int) -> _Layers:
        """Turned by an angle [rad] about ``centre`` (x, y in cells), which comes to lie mid in a square canvas."""
        c, s = math.cos(angle), math.sin(angle)
        middle = side / 2.0
        shift = middle - 0.5 - np.array([[c, -s], [s, c]]) @ (centre - 0.5)
        matrix = np.array([[c, -s, shift[0]], [s, c, shift[1]]])
        walls = np.zeros((side, side), np.float32)
        rows, cols = np.nonzero(self.walls)
        x, y = matrix @ np.stack((cols, rows, np.ones_like(rows)))
        walls[np.rint(y).astype(np.int64), np.rint(x).astype(np.int64)] = 1.0
        wide, free = (
            cv2.warpAffine(layer, matrix, (side, side), flags=cv2.INTER_NEAREST) for layer in (self.wide, self.free)
        )
        return _Layers(walls, np.asarray(wide, np.float32), np.asarray(free, np.float32))


def identifiability(target: OccupancyGrid, source: OccupancyGrid) -> Identifiability:
    """Search all turns and shifts of the source's true footprint over the target's.

    Both are true rasters in one world frame, unknown where the robot saw nothing. Agreement is that of
    ``(hits / (hits + misses))^2 sqrt(hits / walls)``, hits being walls on walls of the other footprint within the
    tolerance, misses walls deep in its free space (squared, because exact rasters leave no excuse for a miss);
    distance is that of the middle of the area that both saw.

    Footprints that share no cell agree by 0. Raises ``ValueError`` where the rasters differ in frame.
    """
    if target.frame != source.frame:
        raise ValueError("identifiability: the two footprints must be rasters of one frame")
    fixed, moving = _layers(target), _layers(source)
    walls = float(fixed.walls.sum() + moving.walls.sum())
    if fixed.walls.sum() == 0 or moving.walls.sum() == 0 or not (target.known & source.known).any():
        return Identifiability(0.0, 0.0)
    centre = _middle(target, source)
    side = 2 * math.ceil(_reach(moving, centre)) + 3
    search = _Search(fixed, side)
    agreement, rival = 0.0, 0.0
    for degrees in range(0, 360, ROTATION_STEP_DEG):
        found = search.agreements(moving.turned(math.radians(degrees), centre, side), walls)
        rows, cols = search.near(centre, NEAR_DISTANCE / COARSE_RESOLUTION)
        if min(degrees, 360 - degrees) <= NEAR_ANGLE_DEG:
            agreement = max(agreement, float(found[rows, cols].max()) if degrees == 0 else 0.0)
            found[rows, cols] = 0.0
        rival = max(rival, float(found.max()))
    return Identifiability(agreement, rival)


def _layers(footprint: OccupancyGrid) -> _Layers:
    step = round(COARSE_RESOLUTION / footprint.frame.resolution)
    fine = footprint.frame.resolution
    deep = ndimage.distance_transform_edt(footprint.free) * fine > TOLERANCE
    near = ndimage.distance_transform_edt(~footprint.occupied) * fine <= TOLERANCE
    walls = _pool(footprint.occupied, step)
    return _Layers(walls, _pool(near, step, share=0.5), _pool(deep, step, share=0.5))


def _pool(mask: NDArray[np.bool_], step: int, share: float = 0.0) -> NDArray[np.float32]:
    rows, cols = (-size % step for size in mask.shape)
    padded = np.pad(mask, ((0, rows), (0, cols)))
    blocks = padded.reshape(padded.shape[0] // step, step, padded.shape[1] // step, step)
    pooled: NDArray[np.float32] = (blocks.mean(axis=(1, 3)) > share).astype(np.float32)
    return pooled


def _middle(target: OccupancyGrid, source: OccupancyGrid) -> NDArray[np.float64]:
    rows, cols = np.nonzero(target.known & source.known)
    fine = target.frame.resolution / COARSE_RESOLUTION
    # The middle of a coarse cell, so that without a turn the cells fall exactly onto themselves.
    return np.floor(np.array([cols.mean() + 0.5, rows.mean() + 0.5]) * fine) + 0.5


def _reach(layers: _Layers, centre: NDArray[np.float64]) -> float:
    rows, cols = np.nonzero(layers.walls + layers.wide + layers.free)
    return float(np.hypot(cols + 0.5 - centre[0], rows + 0.5 - centre[1]).max())


class _Search:
    """Agreement over all shifts at once, by correlation in the frequency domain."""

    def __init__(self, fixed: _Layers, side: int) -> None:
        fixed, self.corner = fixed.cropped()
        rows, cols = fixed.walls.shape
        self.side = side
        self.shape = (fft.next_fast_len(rows + side, real=True), fft.next_fast_len(cols + side, real=True))
        self.walls, self.wide, self.free = (self._spectrum(layer) for layer in (fixed.walls, fixed.wide, fixed.free))

    def _spectrum(self, layer: NDArray[np.float32]) -> NDArray[np.complex64]:
        return np.asarray(fft.rfft2(layer, self.shape), np.complex64)

    def agreements(self, moving: _Layers, total_walls: float) -> NDArray[np.float64]:
        """Agreement at each shift (rows, cols), cyclic: entry [0, 0] lays the canvas on the first cell of the
        raster's cropped part."""
        walls, wide, free = (self._spectrum(layer).conj() for layer in (moving.walls, moving.wide, moving.free))
        hits = np.maximum(fft.irfft2(walls * self.wide + wide * self.walls, self.shape), 0.0)
        misses = np.maximum(fft.irfft2(walls * self.free + free * self.walls, self.shape), 0.0)
        agreement: NDArray[np.float64] = (hits / (hits + misses + 1.0)) ** 2 * np.sqrt(hits / total_walls)
        return agreement

    def near(self, centre: NDArray[np.float64], radius: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Shifts that leave the canvas's middle within ``radius`` cells of where it truly lies."""
        true = np.rint(centre - self.side / 2.0) - self.corner
        span = np.arange(-math.ceil(radius) - 1, math.ceil(radius) + 2)
        rows, cols = np.meshgrid(true[1] + span, true[0] + span, indexing="ij")
        inside = np.hypot(rows - true[1], cols - true[0]) <= radius
        return (
            rows[inside].astype(np.int64) % self.shape[0],
            cols[inside].astype(np.int64) % self.shape[1],
        )
