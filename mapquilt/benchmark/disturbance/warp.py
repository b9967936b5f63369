"""Smooth random warps of a map."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.arrays import sealed
from mapping.grid.occupancy_grid import OccupancyGrid

WARP_QUANTILE = 0.99
"""The size of a warp is this quantile of the displacements of the known cells: the largest but for a few corners."""

INVERSION_STEPS = 8
"""Fixed-point steps of the inversion. A warp of 3 % changes by less than 0.4 a cell, so 0.02 cells remain of 30."""

MARGIN_STEPS = 6
"""Steps of the coarse field beyond the map on each side, further than its smoothing reaches the border."""

Field = NDArray[np.float32]
"""Displacement x, y of each cell (rows, cols, 2) [cells]."""


def smooth_field(shape: tuple[int, int], reach: float, rng: np.random.Generator) -> Field:
    """Draw a smooth random field (rows, cols, 2) whose values correlate over about ``reach`` cells."""
    step = max(1, int(reach / 4.0))
    rows, cols = (side // step + 2 * MARGIN_STEPS for side in shape)
    noise = rng.standard_normal((rows, cols, 2)).astype(np.float32)
    coarse = cv2.GaussianBlur(noise, (0, 0), reach / step / 1.5)
    fine = cv2.resize(coarse, (cols * step, rows * step), interpolation=cv2.INTER_CUBIC)
    low = (MARGIN_STEPS - 1) * step
    return np.ascontiguousarray(fine[low : low + shape[0], low : low + shape[1]])


def warp_field(grid: OccupancyGrid, share: float, reach: float, rng: np.random.Generator) -> Field:
    """Draw a warp that displaces known cells by at most ``share`` of the known diagonal, with no similarity in it.

    ``reach`` is its correlation length [diagonals].
    """
    diagonal = grid.known_diagonal / grid.frame.resolution
    field = without_similarity(smooth_field(grid.frame.shape, reach * diagonal, rng), grid.known)
    largest = float(np.quantile(np.hypot(*field[grid.known].T), WARP_QUANTILE))
    return np.asarray(field * (share * diagonal / largest), np.float32) if largest > 0.0 else field


def without_similarity(field: Field, known: NDArray[np.bool_]) -> Field:
    """Subtract the mean shift, turn and growth of the known cells, by linear least squares.

    Then the true transform stays the nearest to a map that is known wholly.
    """
    cells = np.argwhere(known)
    middle = cells.mean(axis=0)
    arms = cells[:, 1] - middle[1] + 1j * (cells[:, 0] - middle[0])
    shifts = field[known, 0].astype(np.float64) + 1j * field[known, 1]
    square = float((arms * arms.conj()).real.sum())
    factor = complex((shifts * arms.conj()).sum()) / square if square > 0.0 else 0.0
    rows, cols = np.indices(known.shape)
    similar = factor * ((cols - middle[1]) + 1j * (rows - middle[0])) + complex(shifts.mean())
    return np.asarray(field - np.stack((similar.real, similar.imag), axis=-1), np.float32)


def moved_by(grid: OccupancyGrid, field: Field) -> OccupancyGrid:
    """Move each cell by the field, into a raster of the same frame. Each new cell takes the value of the cell nearest
    to its origin, which the inverse of the field gives."""
    rows, cols = np.indices(grid.frame.shape, dtype=np.float32)
    x, y = cols, rows
    for _ in range(INVERSION_STEPS):
        shift = cv2.remap(field, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        x, y = cols - shift[..., 0], rows - shift[..., 1]
    moved = cv2.remap(np.array(grid.log_odds), x, y, cv2.INTER_NEAREST, borderValue=0.0)
    return OccupancyGrid(grid.frame, sealed(moved))
