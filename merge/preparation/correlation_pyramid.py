"""A map as the correlation sees it: where it is free, and where its walls are, at several coarsenesses."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.arrays import sealed
from mapping.grid.occupancy_grid import OccupancyGrid

BEHIND_WALLS = -0.5
"""What lies behind a wall, against 1 for free and 0 for unknown: a wall is a higher step than the end of sight."""

BAND_SHARE = 0.02
"""How far behind its walls a map is filled, as a share of its diagonal."""

DEEP_SHARE = 0.014
"""Free space is deep where nothing else lies within this share of the diagonal."""

SMALLEST_SIDE = 48

Raster = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class CorrelationPyramid:
    """Rasters of the known part of a map, each in cells 1, 2, 4, ... times as wide as the map's.

    ``free`` is 1 in free space and ``BEHIND_WALLS`` in a band behind walls, ``deep`` is 1 deep in free space, ``wall``
    1 on surface cells. ``corner`` is where they begin and ``size`` how far they reach, (x, y) in cells of the map.
    """

    free: tuple[Raster, ...]
    deep: tuple[Raster, ...]
    wall: tuple[Raster, ...]
    corner: tuple[int, int]
    size: tuple[int, int]

    @staticmethod
    def of(grid: OccupancyGrid, surface: NDArray[np.bool_]) -> CorrelationPyramid:
        rows, cols = np.nonzero(grid.known)
        if not rows.size:
            blank = (np.zeros((1, 1), np.float32),)
            return CorrelationPyramid(blank, blank, blank, (0, 0), (1, 1))
        box = slice(rows.min(), rows.max() + 1), slice(cols.min(), cols.max() + 1)
        free = _free(grid, box)
        size = int(np.ptp(cols)) + 1, int(np.ptp(rows)) + 1
        walls = surface[box].astype(np.float32)
        away = cv2.distanceTransform(np.pad(grid.free[box], 1).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)[
            1:-1, 1:-1
        ]
        deep = (away > max(2.0, DEEP_SHARE * math.hypot(*free.shape))).astype(np.float32)
        return CorrelationPyramid(
            _pyramid(free), _pyramid(deep), _pyramid(walls), (int(cols.min()), int(rows.min())), size
        )

    @property
    def middle(self) -> NDArray[np.float64]:
        """The middle (2,) of the known part's bounding box."""
        return np.add(self.corner, np.multiply(self.size, 0.5))

    def placed(self, yaw: float, cells: float, shape: tuple[int, int]) -> NDArray[np.float32]:
        """Free, deep and wall, (3, rows, cols), turned by yaw about the middle, which comes to lie mid in the raster.

        ``cells`` is how many of the map's cells make one of the raster's. Wall is in lengths per cell of the raster.
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


def _free(grid: OccupancyGrid, box: tuple[slice, slice]) -> Raster:
    free, occupied = grid.free[box], grid.occupied[box]
    reach = max(2.0, BAND_SHARE * math.hypot(*free.shape))
    away = cv2.distanceTransform((~occupied).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    band = np.where((away <= reach) & occupied.any(), np.float32(BEHIND_WALLS), np.float32(0.0))
    return np.where(free, np.float32(1.0), band).astype(np.float32)


def _pyramid(layer: Raster) -> tuple[Raster, ...]:
    levels = [sealed(layer)]
    while min(levels[-1].shape) > SMALLEST_SIDE // 2 and max(levels[-1].shape) > SMALLEST_SIDE:
        below = levels[-1]
        even = np.pad(below, ((0, below.shape[0] % 2), (0, below.shape[1] % 2)))
        half = cv2.resize(even, (even.shape[1] // 2, even.shape[0] // 2), interpolation=cv2.INTER_AREA)
        levels.append(sealed(np.asarray(half, np.float32)))
    return tuple(levels)
