"""Reframing of a map: another yaw of the raster, other cells, or only the known part. Metres stay what they are."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.arrays import sealed
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import MAX_PICTURE_CELLS, GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import coarsened, resampled

MOST_CELLS = 2000
"""Cells a side in which the direction of the walls is searched; more only cost time."""
ROUNDING_CELLS = 1e-6


@dataclass(frozen=True)
class Reframing:
    """A raster to convert a map to; what is None or False stays as it is.

    - ``yaw`` [rad] of the origin; 0 bakes the origin's yaw into the picture, for readers that ignore it;
    - ``align_walls``: take the yaw at which most walls run along the rows and columns of the picture;
    - ``resolution`` [m/cell];
    - ``crop``: keep only the bounding box of the known cells.

    Raises ``ValueError`` if yaw and alignment are both asked, or a number is out of range.
    """

    yaw: float | None = None
    align_walls: bool = False
    resolution: float | None = None
    crop: bool = False

    def __post_init__(self) -> None:
        if self.yaw is not None and self.align_walls:
            raise ValueError("--align-walls: chooses the yaw itself, so --yaw must be left out")
        if self.resolution is not None and not (math.isfinite(self.resolution) and self.resolution > 0.0):
            raise ValueError(f"--resolution {self.resolution:g}: must be positive")

    def apply(self, grid: OccupancyGrid) -> OccupancyGrid:
        """Return the map on the new raster, every cell at the same metres.

        Raises ``ValueError`` if the walls have no main direction, or there would be too many cells.
        """
        frame = grid.frame
        yaw = self.yaw if self.yaw is not None else frame.origin.yaw
        if self.align_walls:
            yaw = wall_yaw(grid)
        resolution = self.resolution or frame.resolution
        if yaw != frame.origin.yaw or resolution != frame.resolution:
            inner = grid.cropped() if self.crop else grid
            new = _frame_around(inner.frame, yaw, resolution)
            grid = OccupancyGrid(new, sealed(resampled(inner, Similarity2.identity(), new)))
        return grid.cropped() if self.crop else grid


def wall_yaw(grid: OccupancyGrid) -> float:
    """Return the yaw [rad] of a raster whose rows and columns run along most walls, nearest to the present one.

    Source: Chen 2021, section 5.2. Raises ``ValueError`` if the walls have no main direction.
    """
    from merge.literature.chen2021.main_direction import main_direction
    from merge.literature.chen2021.wall_picture import WALL

    small = coarsened(grid, math.ceil(max(grid.frame.shape) / MOST_CELLS))
    found = main_direction(np.where(small.occupied[::-1], WALL, 0).astype(np.uint8))
    if not found.clear:
        raise ValueError("--align-walls: the walls of this map have no main direction; give --yaw")
    return SE2(0.0, 0.0, grid.frame.origin.yaw - found.angle).yaw


def on_cells_of(grid: OccupancyGrid, target_from_grid: Similarity2, target: GridFrame) -> OccupancyGrid:
    """Return the known part of a map in the metres of another one, on a raster that continues the other's cells.

    Raises ``ValueError`` if there would be too many cells.
    """
    inner = grid.cropped()
    rows, cols = inner.frame.shape
    outer = np.array([(0, 0), (0, cols), (rows, 0), (rows, cols)]) - 0.5  # the corner of a cell, not its centre
    corners = target_from_grid.apply(inner.frame.metres_from_cells(outer))
    xs, ys = (target.origin.inverse().apply(corners) / target.resolution).T
    low = math.floor(ys.min() + ROUNDING_CELLS), math.floor(xs.min() + ROUNDING_CELLS)
    high = math.ceil(ys.max() - ROUNDING_CELLS), math.ceil(xs.max() - ROUNDING_CELLS)
    shape = max(1, high[0] - low[0]), max(1, high[1] - low[1])
    if shape[0] * shape[1] > MAX_PICTURE_CELLS:
        raise ValueError(
            f"resolution {target.resolution:g}: gives {shape[1]} x {shape[0]} cells, more than the "
            f"{MAX_PICTURE_CELLS} that a map may have"
        )
    new = target.window(low, shape)
    return OccupancyGrid(new, sealed(resampled(inner, target_from_grid, new)))


def _frame_around(old: GridFrame, yaw: float, resolution: float) -> GridFrame:
    """Return the smallest frame of that yaw and resolution that holds all of another."""
    rows, cols = old.shape
    outer = np.array([(0, 0), (0, cols), (rows, 0), (rows, cols)]) - 0.5  # the corner of a cell, not its centre
    turned = SE2(0.0, 0.0, yaw)
    corners = turned.inverse().apply(old.metres_from_cells(outer)) / resolution
    low = corners.min(axis=0)
    width, height = (math.ceil(side - ROUNDING_CELLS) for side in corners.max(axis=0) - low)
    if width * height > MAX_PICTURE_CELLS:
        raise ValueError(
            f"--resolution {resolution:g}: gives {width} x {height} cells, more than the {MAX_PICTURE_CELLS} that a "
            "map may have"
        )
    x, y = turned.apply(low[None] * resolution)[0].tolist()
    return GridFrame(resolution, SE2(x, y, yaw), (max(1, height), max(1, width)))
