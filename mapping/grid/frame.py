"""Frames of grids: the only place that converts cells or pixels to metres, or back."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapping.geometry.se2 import SE2

MAX_PICTURE_CELLS = 2**27
"""The most cells of a map that is stored as a picture: 580 m by 580 m at 5 cm."""


def require_area(owner: str, low: ArrayLike, high: ArrayLike, cell: float) -> None:
    """Check that a raster from ``low`` to ``high`` (2,) x, y [m] in cells of ``cell`` [m] can be made and indexed.

    Compiled code that indexes by coordinates does not check them. Raises ``ValueError`` that begins with ``owner`` if
    a coordinate is not finite or the raster has more than ``MAX_PICTURE_CELLS`` cells.
    """
    spans = (np.asarray(high, np.float64) - np.asarray(low, np.float64)).tolist()
    if not (spans[0] / cell + 1.0) * (spans[1] / cell + 1.0) <= MAX_PICTURE_CELLS:
        raise ValueError(
            f"{owner}: spans {spans[0]:g} x {spans[1]:g} m, must have at most {MAX_PICTURE_CELLS} cells of {cell:g} m; "
            "is a range or a pose wrong?"
        )


@dataclass(frozen=True)
class GridFrame:
    """A raster in the plane, as nav_msgs/MapMetaData describes it.

    ``resolution`` in metres a cell; ``origin`` the pose of the outer corner of cell (0, 0) in the map frame;
    ``shape`` (rows, cols). Cell [row, col] spans x in [col, col + 1] and y in [row, row + 1] cells from that corner.

    Raises ``ValueError`` if the resolution is not positive and finite or the shape is empty.
    """

    resolution: float
    origin: SE2
    shape: tuple[int, int]

    def __post_init__(self) -> None:
        object.__setattr__(self, "resolution", float(self.resolution))
        object.__setattr__(self, "shape", (int(self.shape[0]), int(self.shape[1])))
        if not (math.isfinite(self.resolution) and self.resolution > 0.0):
            raise ValueError(f"GridFrame: resolution is {self.resolution}, must be positive and finite")
        if min(self.shape) < 1:
            raise ValueError(f"GridFrame: shape is {self.shape}, needs at least one cell")

    def metres_from_cells(self, cells: ArrayLike) -> NDArray[np.float64]:
        """Return the centres [m], (N, 2) rows of x, y, of cells, (N, 2) rows of row, col."""
        cells = np.asarray(cells, dtype=np.float64)
        local = (cells[..., ::-1] + 0.5) * self.resolution
        return self.origin.apply(local)

    def cells_from_metres(self, points: ArrayLike) -> NDArray[np.int64]:
        """Return the cells, (N, 2) rows of row, col, of points, (N, 2) rows of x, y [m]. They may lie outside."""
        local = self.origin.inverse().apply(points) / self.resolution
        return np.floor(local[..., ::-1]).astype(np.int64)

    def contains(self, cells: ArrayLike) -> NDArray[np.bool_]:
        """Mark the cells (N, 2), rows of row, col, that lie in the raster: (N,)."""
        cells = np.asarray(cells)
        inside: NDArray[np.bool_] = np.all((cells >= 0) & (cells < np.array(self.shape)), axis=-1)
        return inside

    def window(self, corner: tuple[int, int], shape: tuple[int, int]) -> GridFrame:
        """Return the raster of ``shape`` (rows, cols) on the same cells that begins at cell ``corner`` (row, col)."""
        row, col = corner
        moved = self.origin @ SE2(col * self.resolution, row * self.resolution)
        return GridFrame(self.resolution, moved, shape)

    def metre_from_pixel(self) -> NDArray[np.float64]:
        """Return the (3, 3) affine map from pixel (u, v, 1), centres at integers and v down, to metre (x, y, 1).

        ``metre = origin + r R(yaw) (u + 1/2, H - 1/2 - v)``: pixel (0, H - 1) is the centre of cell (0, 0).
        """
        r, height = self.resolution, self.shape[0]
        c, s = r * math.cos(self.origin.yaw), r * math.sin(self.origin.yaw)
        right, up = 0.5, height - 0.5
        return np.array(
            [
                [c, s, self.origin.x + c * right - s * up],
                [s, -c, self.origin.y + s * right + c * up],
                [0.0, 0.0, 1.0],
            ]
        )
