"""Kinds of disturbances of a map: pure functions of the map and a stream of random numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.arrays import sealed
from mapping.grid.occupancy_grid import TRINARY_LOG_ODDS, OccupancyGrid
from mapquilt.benchmark.disturbance.settings import DisturbanceSettings
from mapquilt.benchmark.disturbance.warp import Field, moved_by, smooth_field, warp_field

Values = NDArray[np.floating]


@dataclass(frozen=True, eq=False)
class DisturbedMap:
    """A disturbed map of the frame of the map ``before``; ``moved`` displaces the cells of that, None if they stay."""

    grid: OccupancyGrid
    before: OccupancyGrid
    moved: Field | None = None


Disturbance = Callable[[OccupancyGrid, DisturbanceSettings, np.random.Generator], DisturbedMap]


def warp(share: float) -> Disturbance:
    """Return a smooth warp by at most ``share`` of the map's diagonal."""

    def warped(grid: OccupancyGrid, settings: DisturbanceSettings, rng: np.random.Generator) -> DisturbedMap:
        wide = grid.cropped(math.ceil(2.0 * share * grid.known_diagonal / grid.frame.resolution) + 1)
        field = warp_field(wide, share, rng.uniform(*settings.warp_reach), rng)
        return DisturbedMap(moved_by(wide, field), wide, field)

    return warped


def specks(grid: OccupancyGrid, settings: DisturbanceSettings, rng: np.random.Generator) -> DisturbedMap:
    """Turn single cells over: floor to wall, wall to floor."""
    turned = grid.known & (rng.random(grid.frame.shape) < settings.speck_share)
    return _redrawn(grid, np.where(turned, -grid.log_odds, grid.log_odds))


def thick_walls(grid: OccupancyGrid, settings: DisturbanceSettings, rng: np.random.Generator) -> DisturbedMap:
    """Thicken all walls on both sides."""
    low, high = settings.thicker_cells
    side = 2 * int(rng.integers(low, high + 1)) + 1
    grown = cv2.dilate(grid.occupied.astype(np.uint8), np.ones((side, side), np.uint8)) > 0
    return _redrawn(grid, np.where(grown & ~grid.occupied, TRINARY_LOG_ODDS, grid.log_odds))


def crop(grid: OccupancyGrid, settings: DisturbanceSettings, rng: np.random.Generator) -> DisturbedMap:
    """Cut a part off along a line of any direction."""
    angle = rng.uniform(0.0, math.tau)
    rows, cols = np.indices(grid.frame.shape)
    along = rows * math.sin(angle) + cols * math.cos(angle)
    border = np.quantile(along[grid.known], rng.uniform(*settings.kept_share))
    return _redrawn(grid, np.where(along > border, 0.0, grid.log_odds))


def gaps(grid: OccupancyGrid, settings: DisturbanceSettings, rng: np.random.Generator) -> DisturbedMap:
    """Forget patches of the map."""
    reach = settings.gap_reach * grid.known_diagonal / grid.frame.resolution
    height = smooth_field(grid.frame.shape, reach, rng)[..., 0]
    level = np.quantile(height[grid.known], rng.uniform(*settings.gap_share))
    return _redrawn(grid, np.where(height < level, 0.0, grid.log_odds))


def furniture(grid: OccupancyGrid, settings: DisturbanceSettings, rng: np.random.Generator) -> DisturbedMap:
    """Put boxes on free floor: furniture that came between two visits. Their insides are unknown; walls stay."""
    values, free = np.array(grid.log_odds), np.argwhere(grid.free)
    low, high = settings.boxes
    for _ in range(int(rng.integers(low, high + 1)) if len(free) else 0):
        row, col = free[rng.integers(len(free))]
        height, width = np.ceil(rng.uniform(*settings.box_side, 2) / grid.frame.resolution).astype(int)
        place = np.s_[row : row + height, col : col + width]
        inside = np.zeros(grid.free[place].shape, bool)
        inside[1 : height - 1, 1 : width - 1] = True
        values[place] = np.where(
            grid.free[place], np.where(inside, 0.0, np.float32(TRINARY_LOG_ODDS)), grid.log_odds[place]
        )
    return _redrawn(grid, values)


def _redrawn(grid: OccupancyGrid, values: Values) -> DisturbedMap:
    return DisturbedMap(OccupancyGrid(grid.frame, sealed(np.asarray(values, np.float32))), grid)


KINDS: dict[str, Disturbance] = {
    "warp-1": warp(0.01),
    "warp-2": warp(0.02),
    "warp-3": warp(0.03),
    "specks": specks,
    "thick-walls": thick_walls,
    "crop": crop,
    "gaps": gaps,
    "furniture": furniture,
}
"""By name; a warp is named by its size in per cent of the diagonal."""
