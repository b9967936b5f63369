"""Rasters of free space and walls at several resolutions, for the correlation of two maps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.arrays import sealed
from merge.preparation.settings import PreparationSettings

Raster = NDArray[np.float32]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class CorrelationPyramid:
    """Rasters of the known part of a map, each in cells 1, 2, 4, ... times as wide as the map's.

    ``free`` is 1 in free space and ``behind_walls`` (``PreparationSettings``) in a band behind walls; ``deep`` is 1
    deep in free space; ``wall`` is 1 on surface cells. ``corner`` is their lower left corner and ``size`` their extent,
    (x, y) in cells of the map.
    """

    free: tuple[Raster, ...]
    deep: tuple[Raster, ...]
    wall: tuple[Raster, ...]
    corner: tuple[int, int]
    size: tuple[int, int]

    @staticmethod
    def of(free: Mask, occupied: Mask, surface: Mask, settings: PreparationSettings) -> CorrelationPyramid:
        """Build the pyramid of a map from its free, occupied and surface cells (rows, cols)."""
        rows, cols = np.nonzero(free | occupied)
        if not rows.size:
            blank = (np.zeros((1, 1), np.float32),)
            return CorrelationPyramid(blank, blank, blank, (0, 0), (1, 1))
        box = slice(rows.min(), rows.max() + 1), slice(cols.min(), cols.max() + 1)
        raster = _free(free[box], occupied[box], settings)
        size = int(np.ptp(cols)) + 1, int(np.ptp(rows)) + 1
        walls = surface[box].astype(np.float32)
        away = cv2.distanceTransform(np.pad(free[box], 1).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)[1:-1, 1:-1]
        deep = (away > max(2.0, settings.deep_share * math.hypot(*raster.shape))).astype(np.float32)
        return CorrelationPyramid(
            _pyramid(raster, settings.coarsest_cells),
            _pyramid(deep, settings.coarsest_cells),
            _pyramid(walls, settings.coarsest_cells),
            (int(cols.min()), int(rows.min())),
            size,
        )

    @property
    def middle(self) -> NDArray[np.float64]:
        """Middle (2,) of the known part's bounding box."""
        return np.add(self.corner, np.multiply(self.size, 0.5))

    def resample(self, yaw: float, cells: float, shape: tuple[int, int]) -> NDArray[np.float32]:
        """Resample free, deep and wall (3, rows, cols), rotated by yaw about the middle, which becomes the raster's.

        ``cells`` is the width of a cell of the raster, in cells of the map. Wall is in lengths per cell of the raster.
        """
        level = min(len(self.free) - 1, max(0, math.floor(math.log2(max(cells, 1.0)))))
        matrix = _placing(yaw, cells, shape, self.size, 2**level)
        out = np.empty((3, *shape), np.float32)
        for k, layer in enumerate((self.free[level], self.deep[level], self.wall[level])):
            cv2.warpAffine(layer, matrix, shape[::-1], dst=out[k], flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
        out[2] *= cells
        return out


def _placing(
    yaw: float, cells: float, shape: tuple[int, int], size: tuple[int, int], level: int
) -> NDArray[np.float64]:
    # pixel of the layer = (R(-yaw) cells (pixel + 1/2 - shape / 2) + size / 2) / level - 1/2
    c, s = math.cos(yaw) * cells / level, math.sin(yaw) * cells / level
    turn = np.array([[c, s], [-s, c]])
    away = 0.5 - np.array(shape[::-1]) / 2.0
    shift = turn @ away + np.array(size) / (2.0 * level) - 0.5
    return np.column_stack((turn, shift))


def _free(free: Mask, occupied: Mask, settings: PreparationSettings) -> Raster:
    reach = max(2.0, settings.band_share * math.hypot(*free.shape))
    away = cv2.distanceTransform((~occupied).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    band = np.where((away <= reach) & occupied.any(), np.float32(settings.behind_walls), np.float32(0.0))
    return np.where(free, np.float32(1.0), band).astype(np.float32)


def _pyramid(layer: Raster, coarsest: int) -> tuple[Raster, ...]:
    levels = [sealed(layer)]
    while min(levels[-1].shape) > coarsest // 2 and max(levels[-1].shape) > coarsest:
        below = levels[-1]
        even = np.pad(below, ((0, below.shape[0] % 2), (0, below.shape[1] % 2)))
        half = cv2.resize(even, (even.shape[1] // 2, even.shape[0] // 2), interpolation=cv2.INTER_AREA)
        levels.append(sealed(np.asarray(half, np.float32)))
    return tuple(levels)
