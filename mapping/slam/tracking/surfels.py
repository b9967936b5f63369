"""Local map of surfels: the mean and covariance of the points in each voxel, by the side that a wall shows."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.grid.frame import require_area
from mapping.slam.settings import LocalMapSettings

SAME_SURFACE = 0.7
"""Least cosine between the normals of points on one surface."""

FEWEST_POINTS = 3
"""Points that a line or a blob is fitted to, at least."""


class SurfelMap(NamedTuple):
    """Surfels in a grid of voxels.

    ``first`` (rows * cols) is the first surfel of a voxel or -1, ``following`` (S,) the next one of the same voxel.
    ``means`` (S, 2), ``normals`` (S, 2). ``information`` (S, 3): xx, xy, yy of the inverse covariance without the
    noise of the matched point; ``variances`` (S,): across a line; 0 where the surfel is no line.
    """

    x: float
    y: float
    voxel: float
    cols: int
    rows: int
    first: NDArray[np.int32]
    following: NDArray[np.int32]
    means: NDArray[np.float64]
    normals: NDArray[np.float64]
    information: NDArray[np.float64]
    variances: NDArray[np.float64]


def surfel_map(
    points: NDArray[np.float64], normals: NDArray[np.float64], voxel: float, settings: LocalMapSettings
) -> SurfelMap | None:
    """Build the surfels of points (N, 2) [m] with normals (N, 2) in one frame; None if there is no point.

    A surfel takes in the points of its voxel, of side ``voxel`` [m], and of the eight around it whose normals agree.
    Where they lie on a line, its mean is that of its own voxel, drawn onto the line. Raises ``ValueError`` if the
    points lie too far apart for a grid.
    """
    if len(points) == 0:
        return None
    require_area("surfel_map", points.min(axis=0), points.max(axis=0), voxel)
    return _build(points, normals, voxel, settings.line_ratio, settings.roughness)


@njit(cache=True)
def _build(
    points: NDArray[np.float64], normals: NDArray[np.float64], voxel: float, line_ratio: float, roughness: float
) -> SurfelMap:
    low_x, low_y = points[:, 0].min() - voxel, points[:, 1].min() - voxel
    cols = int((points[:, 0].max() - low_x) / voxel) + 2
    rows = int((points[:, 1].max() - low_y) / voxel) + 2
    first = np.full(rows * cols, -1, np.int32)
    following = np.full(points.shape[0], -1, np.int32)
    cells = np.empty(points.shape[0], np.int64)
    sums = np.zeros((points.shape[0], 8))  # number, x, y, xx, xy, yy, normal x, normal y
    count = _sum_points(points, normals, low_x, low_y, voxel, cols, first, following, cells, sums)
    means, directions = np.empty((count, 2)), np.empty((count, 2))
    information, variances = np.zeros((count, 3)), np.zeros(count)
    for surfel in range(count):
        merged = _with_neighbours(sums, first, following, cells[surfel], surfel, rows, cols)
        _fit(
            sums[surfel], merged, line_ratio, roughness, means[surfel], directions[surfel], information[surfel],
            variances[surfel : surfel + 1],
        )  # fmt: skip
        means[surfel, 0] += low_x
        means[surfel, 1] += low_y
    return SurfelMap(
        low_x, low_y, voxel, cols, rows, first, following[:count].copy(), means, directions, information, variances
    )


@njit(cache=True)
def _sum_points(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    low_x: float,
    low_y: float,
    voxel: float,
    cols: int,
    first: NDArray[np.int32],
    following: NDArray[np.int32],
    cells: NDArray[np.int64],
    sums: NDArray[np.float64],
) -> int:
    """Sum up the points of each voxel, apart for normals that disagree; return the number of surfels."""
    count = 0
    for k in range(points.shape[0]):
        x, y = points[k, 0] - low_x, points[k, 1] - low_y
        cell = int(y / voxel) * cols + int(x / voxel)
        surfel = first[cell]
        while surfel >= 0:
            nx, ny = sums[surfel, 6], sums[surfel, 7]
            if nx * normals[k, 0] + ny * normals[k, 1] > SAME_SURFACE * math.hypot(nx, ny):
                break
            surfel = following[surfel]
        if surfel < 0:
            surfel = count
            following[surfel], first[cell] = first[cell], surfel
            cells[surfel] = cell
            count += 1
        row = sums[surfel]
        row[0] += 1.0
        row[1] += x
        row[2] += y
        row[3] += x * x
        row[4] += x * y
        row[5] += y * y
        row[6] += normals[k, 0]
        row[7] += normals[k, 1]
    return count


@njit(cache=True)
def _with_neighbours(
    sums: NDArray[np.float64],
    first: NDArray[np.int32],
    following: NDArray[np.int32],
    cell: int,
    surfel: int,
    rows: int,
    cols: int,
) -> NDArray[np.float64]:
    """Return the sums (8,) of a surfel and of those in the eight voxels around whose normals agree."""
    merged: NDArray[np.float64] = sums[surfel].copy()
    length = math.hypot(merged[6], merged[7])
    nx, ny = merged[6] / length, merged[7] / length
    row, col = cell // cols, cell % cols
    for r in range(max(row - 1, 0), min(row + 2, rows)):
        for c in range(max(col - 1, 0), min(col + 2, cols)):
            if r == row and c == col:
                continue
            other = first[r * cols + c]
            while other >= 0:
                ox, oy = sums[other, 6], sums[other, 7]
                if nx * ox + ny * oy > SAME_SURFACE * math.hypot(ox, oy):
                    merged += sums[other]
                other = following[other]
    return merged


@njit(cache=True)
def _fit(
    own: NDArray[np.float64],
    merged: NDArray[np.float64],
    line_ratio: float,
    roughness: float,
    mean: NDArray[np.float64],
    direction: NDArray[np.float64],
    information: NDArray[np.float64],
    variance: NDArray[np.float64],
) -> None:
    """Fit mean (2,), normal ``direction`` (2,), and either the ``variance`` (1,) across a line or the ``information``
    (3,) of a blob, to the sums (8,) of a surfel's own voxel and of all."""
    number = merged[0]
    mx, my = merged[1] / number, merged[2] / number
    xx, xy, yy = merged[3] / number - mx * mx, merged[4] / number - mx * my, merged[5] / number - my * my
    middle, spread = 0.5 * (xx + yy), math.hypot(0.5 * (xx - yy), xy)
    large, small = middle + spread, max(middle - spread, 0.0)
    along = 0.5 * math.atan2(2.0 * xy, xx - yy)
    lx, ly = -math.sin(along), math.cos(along)
    length = math.hypot(own[6], own[7])
    if lx * (own[6] / length) + ly * (own[7] / length) < 0.0:
        lx, ly = -lx, -ly
    x, y = own[1] / own[0], own[2] / own[0]
    direction[0], direction[1] = lx, ly
    if number < FEWEST_POINTS:
        direction[:] = 0.0
    elif small < line_ratio * large:
        across = lx * (x - mx) + ly * (y - my)
        x, y = x - across * lx, y - across * ly
        variance[0] = small + roughness**2
    else:
        small, large = small + roughness**2, large + roughness**2
        information[0] = ly * ly / large + lx * lx / small
        information[1] = lx * ly * (1.0 / small - 1.0 / large)
        information[2] = lx * lx / large + ly * ly / small
    mean[0], mean[1] = x, y
