"""The occupancy grid."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapping.arrays import frozen_array, sealed
from mapping.grid.frame import GridFrame

OCCUPIED, FREE, UNKNOWN = 100, 0, -1
"""The values of nav_msgs/OccupancyGrid in a trinary map."""

TRINARY_LOG_ODDS = math.log(0.9 / 0.1)
"""Log-odds of a cell of a trinary file: occupied with probability 0.9, or 0.1 if free."""

SMALLEST_MISS = np.float32(-1e-6)
"""Log-odds of an observed cell whose evidence cancels: free, and not unknown."""


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """Log-odds of occupancy, ``log_odds`` (rows, cols) float32, row 0 lowest: > 0 occupied, < 0 free, 0 unknown.

    Raises ``ValueError`` if the array does not have the frame's shape or has a number that is not finite.
    """

    frame: GridFrame
    log_odds: NDArray[np.float32]

    def __post_init__(self) -> None:
        object.__setattr__(self, "log_odds", frozen_array(self.log_odds, np.float32))
        if self.log_odds.shape != self.frame.shape:
            raise ValueError(
                f"OccupancyGrid: log_odds has shape {self.log_odds.shape}, must have the frame's, {self.frame.shape}"
            )
        if not np.isfinite(self.log_odds).all():
            raise ValueError("OccupancyGrid: log_odds has a number that is not finite")

    @staticmethod
    def from_occupancy(frame: GridFrame, occupancy: ArrayLike) -> OccupancyGrid:
        """Make a grid of trinary values (rows, cols): 100 occupied, 0 free, -1 unknown."""
        values = np.asarray(occupancy)
        signs = (values == OCCUPIED).astype(np.float32) - (values == FREE).astype(np.float32)
        return OccupancyGrid(frame, np.float32(TRINARY_LOG_ODDS) * signs)

    @property
    def occupied(self) -> NDArray[np.bool_]:
        return self.log_odds > 0.0

    @property
    def free(self) -> NDArray[np.bool_]:
        return self.log_odds < 0.0

    @property
    def known(self) -> NDArray[np.bool_]:
        return np.not_equal(self.log_odds, 0.0)

    @property
    def known_diagonal(self) -> float:
        """Diagonal of the bounding box of the known cells [stated metres]; 0 without any."""
        known = self.known
        rows, cols = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
        if rows.size == 0:
            return 0.0
        return self.frame.resolution * math.hypot(float(np.ptp(rows)) + 1.0, float(np.ptp(cols)) + 1.0)

    def cropped(self, margin: int = 0) -> OccupancyGrid:
        """Crop to the bounding box of the known cells and ``margin`` cells around it.

        Cells beyond the raster are unknown; coordinates in metres do not change. A grid without known cells keeps one
        cell and its margin. Without a margin the cells are shared, not copied.
        """
        known = self.known
        rows, cols = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
        low, left, high, right = (rows[0], cols[0], rows[-1], cols[-1]) if rows.size else (0, 0, 0, 0)
        box = self.log_odds[low : high + 1, left : right + 1]
        box = sealed(np.pad(box, margin)) if margin else box
        return OccupancyGrid(self.frame.window((int(low) - margin, int(left) - margin), box.shape), box)

    def occupancy(self) -> NDArray[np.int8]:
        """Return the trinary map (rows, cols) int8 of nav_msgs/OccupancyGrid: 100, 0 or -1, row 0 lowest."""
        values = np.full(self.frame.shape, UNKNOWN, dtype=np.int8)
        values[self.occupied] = OCCUPIED
        values[self.free] = FREE
        return values
