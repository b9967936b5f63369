"""Step 5.4: tile the walls greedily, with a point for each tile."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from merge.literature.chen2021.wall_picture import Image

Points = NDArray[np.intp]
"""Pixels (N, 2) u, v, from top to bottom and from left to right."""


def tile_half(thickness: float) -> int:
    """Choose L so that a tile of 2L + 1 pixels is as wide as walls of this thickness, and at least 3.

    Chen set it manually: to 2, 3 for a noisy map, 1 for a coarse one.
    """
    return max(1, math.ceil((thickness - 1.0) / 2.0))


def dilated(walls: Image, half: int) -> Image:
    """Dilate the walls by ``half`` pixels on every side.

    The thinnest wall then holds a tile, and one as wide as a tile does not hold two side by side.
    """
    side = 2 * half + 1
    return np.asarray(cv2.dilate(walls, np.ones((side, side), np.uint8)), np.uint8)


def interest_points(walls: Image, half: int) -> Points:
    """Place points (N, 2) u, v on the walls of a picture, one every 2 ``half`` + 1 pixels.

    Source: Chen 2021, section 5.4. The walls are dilated and scanned. Wherever a whole window of 2 ``half`` + 1 pixels
    is wall, its centre becomes a point and the window is erased. The scan meets a thick wall at its upper left side, so
    each point then moves to the centre line of the wall.
    """
    tiles = _tiled(dilated(walls, half), half)
    points = _centred(walls, tiles, half)
    return np.unique(points[:, ::-1], axis=0)[:, ::-1].astype(np.intp)  # sorted by v, then u


def point_picture(points: Points, shape: tuple[int, int]) -> Image:
    """Draw the points as single white pixels of a picture of ``shape`` (rows, cols)."""
    picture = np.zeros(shape, np.uint8)
    picture[points[:, 1], points[:, 0]] = 255
    return picture


@njit(cache=True)
def _tiled(walls: NDArray[np.uint8], half: int) -> NDArray[np.int64]:
    left = walls.copy()
    points = np.empty((np.count_nonzero(left) // (2 * half + 1) ** 2 + 1, 2), np.int64)
    count = 0
    for row in range(half, left.shape[0] - half):
        for col in range(half, left.shape[1] - half):
            if left[row, col] == 0 or not _full(left, row, col, half):
                continue
            left[row - half : row + half + 1, col - half : col + half + 1] = 0
            points[count] = col, row
            count += 1
    return points[:count]


@njit(cache=True)
def _full(walls: NDArray[np.uint8], row: int, col: int, half: int) -> bool:
    for r in range(row - half, row + half + 1):
        for c in range(col - half, col + half + 1):
            if walls[r, c] == 0:
                return False
    return True


@njit(cache=True)
def _centred(walls: NDArray[np.uint8], points: NDArray[np.int64], half: int) -> NDArray[np.int64]:
    """Move each point to the middle of the shorter run of wall through it, or through the nearest wall pixel."""
    moved = points.copy()
    for k in range(len(points)):
        row, col = _nearest_wall(walls, points[k, 1], points[k, 0], half)
        if row < 0:
            continue
        left, right, top, bottom = col, col, row, row
        while left > 0 and walls[row, left - 1] != 0:
            left -= 1
        while right + 1 < walls.shape[1] and walls[row, right + 1] != 0:
            right += 1
        while top > 0 and walls[top - 1, col] != 0:
            top -= 1
        while bottom + 1 < walls.shape[0] and walls[bottom + 1, col] != 0:
            bottom += 1
        if right - left < bottom - top:
            col = (left + right) // 2
        elif bottom - top < right - left:
            row = (top + bottom) // 2
        elif walls[(top + bottom) // 2, (left + right) // 2] != 0:  # a pillar has its middle both ways
            row, col = (top + bottom) // 2, (left + right) // 2
        moved[k] = col, row
    return moved


@njit(cache=True)
def _nearest_wall(walls: NDArray[np.uint8], row: int, col: int, half: int) -> tuple[int, int]:
    best, found_row, found_col = 2 * half * half + 1, -1, -1
    for r in range(max(0, row - half), min(walls.shape[0], row + half + 1)):
        for c in range(max(0, col - half), min(walls.shape[1], col + half + 1)):
            distance = (r - row) ** 2 + (c - col) ** 2
            if walls[r, c] != 0 and distance < best:
                best, found_row, found_col = distance, r, c
    return found_row, found_col
