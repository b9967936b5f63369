"""Exact traversal of a grid by beams, compiled.

Amanatides and Woo, "A Fast Voxel Traversal Algorithm for Ray Tracing", Eurographics 1987. Two changes keep it exact:
the parameter of each boundary is computed afresh instead of summed up, and the number of steps is known from the end
cells, so that rounding can neither drift nor overshoot. A beam through a corner of cells steps in y first.

Coordinates are in cells: cell [row, col] spans x in [col, col + 1), y in [row, row + 1).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

SKIP, MISS, HIT = 0, 1, 2
"""Kind of a beam: measured nothing; free along its way; free along its way and a hit at its end."""

ROUNDING = 1e-6
"""More than a coordinate in cells changes when the raster's corner is subtracted [cells]."""


@njit(cache=True)
def beam_ends(
    ranges: NDArray[np.float32],
    angle_min: float,
    angle_increment: float,
    x: float,
    y: float,
    yaw: float,
    clear_range: float,
    resolution: float,
) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
    """Return the endpoints of beams, (B, 2) rows of x, y in cells, and their kinds (B,): SKIP, MISS or HIT.

    A beam without a return clears the cells up to ``clear_range`` [m]; zero clears nothing. A beam to something too
    close is skipped.
    """
    ends = np.empty((ranges.size, 2))
    kinds = np.empty(ranges.size, np.int8)
    for k in range(ranges.size):
        length = float(ranges[k])
        kinds[k] = HIT
        if not math.isfinite(length):
            kinds[k] = MISS if length > 0.0 and clear_range > 0.0 else SKIP
            length = clear_range if kinds[k] == MISS else 0.0
        angle = yaw + angle_min + k * angle_increment
        ends[k, 0] = (x + length * math.cos(angle)) / resolution
        ends[k, 1] = (y + length * math.sin(angle)) / resolution
    return ends, kinds


def scan_extent(start: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the first and the last cell of a raster that holds beams from ``start`` (2,) to ``ends`` (B, 2), in cells:
    (2, 2), rows of x, y, whole numbers.

    A coordinate just below a whole number is rounded up to it when the raster's corner is subtracted; the last cell
    allows for that.
    """
    low, high = np.minimum(ends.min(axis=0), start), np.maximum(ends.max(axis=0), start)
    return np.floor((low, high + ROUNDING))


def draw_scan(
    total: NDArray[np.float32],
    visits: NDArray[np.int32],
    last_scan: NDArray[np.int32],
    scan: np.int32,
    x0: float,
    y0: float,
    ends: NDArray[np.float64],
    kinds: NDArray[np.int8],
    hit_step: np.float32,
    miss_step: np.float32,
    low: np.float32,
    high: np.float32,
    count: bool,
) -> None:
    """Add one scan to ``total`` (and ``visits`` if ``count``): each cell at most once, a hit before any miss.

    ``last_scan`` holds for each cell the number of the scan that touched it last. ``x0``, ``y0`` and ``ends`` (B, 2)
    are in cells of the arrays, which are (rows, cols).

    Raises ``ValueError`` if the beams do not lie in the arrays, because the compiled code writes without a check.
    """
    rows, cols = total.shape
    least, most = ends.min(axis=0), ends.max(axis=0)  # NaN, if there is any, so that comparisons fail
    in_x = 0.0 <= x0 < cols and least[0] >= 0.0 and most[0] < cols
    in_y = 0.0 <= y0 < rows and least[1] >= 0.0 and most[1] < rows
    if not (in_x and in_y) or last_scan.shape != total.shape or (count and visits.shape != total.shape):
        raise ValueError(f"scan {scan}: a beam leaves the raster of {rows} x {cols} cells")
    _draw_scan(total, visits, last_scan, scan, x0, y0, ends, kinds, hit_step, miss_step, low, high, count)


@njit(cache=True)
def _draw_scan(
    total: NDArray[np.float32],
    visits: NDArray[np.int32],
    last_scan: NDArray[np.int32],
    scan: np.int32,
    x0: float,
    y0: float,
    ends: NDArray[np.float64],
    kinds: NDArray[np.int8],
    hit_step: np.float32,
    miss_step: np.float32,
    low: np.float32,
    high: np.float32,
    count: bool,
) -> None:
    """Draw a scan whose beams lie in the arrays."""
    cols = total.shape[1]
    total_flat, visits_flat, last_flat = total.ravel(), visits.ravel(), last_scan.ravel()
    for k in range(ends.shape[0]):
        if kinds[k] == HIT:
            cell = math.floor(ends[k, 1]) * cols + math.floor(ends[k, 0])
            if last_flat[cell] != scan:
                last_flat[cell] = scan
                total_flat[cell] = min(total_flat[cell] + hit_step, high)
                if count:
                    visits_flat[cell] += 1
    col_0, row_0 = math.floor(x0), math.floor(y0)
    for k in range(ends.shape[0]):
        if kinds[k] == SKIP:
            continue
        dx, dy = ends[k, 0] - x0, ends[k, 1] - y0
        cell = row_0 * cols + col_0
        steps_x, steps_y = abs(math.floor(ends[k, 0]) - col_0), abs(math.floor(ends[k, 1]) - row_0)
        step_x, step_y = (1 if dx > 0.0 else -1), (cols if dy > 0.0 else -cols)
        apart_x, apart_y = (abs(1.0 / dx) if steps_x else math.inf), (abs(1.0 / dy) if steps_y else math.inf)
        to_x = (col_0 + 1 - x0) if dx > 0.0 else (x0 - col_0)
        to_y = (row_0 + 1 - y0) if dy > 0.0 else (y0 - row_0)
        t_x, t_y = (to_x * apart_x if steps_x else math.inf), (to_y * apart_y if steps_y else math.inf)
        for _ in range(steps_x + steps_y + 1):
            if last_flat[cell] != scan:
                last_flat[cell] = scan
                value = total_flat[cell] + miss_step
                total_flat[cell] = value if value > low else low
                if count:
                    visits_flat[cell] += 1
            if t_x < t_y:
                cell += step_x
                to_x += 1.0
                steps_x -= 1
                t_x = to_x * apart_x if steps_x > 0 else math.inf
            else:
                cell += step_y
                to_y += 1.0
                steps_y -= 1
                t_y = to_y * apart_y if steps_y > 0 else math.inf
