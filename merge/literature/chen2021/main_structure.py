"""Step 5.5: reduce walls to one-pixel polylines along rows and columns, pillars to squares; detect corners."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.validation import require_valid
from merge.literature.chen2021.wall_picture import WALL, Image


@dataclass(frozen=True)
class StructureSettings:
    """Links of the main structure, and its corners.

    - ``reach_tiles``: the next point of a wall is sought within so many tiles in u and in v: Chen's 20 pixels, where L
      is 2;
    - ``max_off_wall``: a link is dropped if more than this share of it is off the walls;
    - ``max_corners``: the strongest corners are kept;
    - ``min_quality``: least corner response, as a share of the strongest;
    - ``iterations``, ``precision_pixels``: a corner is refined to subpixels until it moves less than this.
    """

    reach_tiles: int = 4
    max_off_wall: float = 0.5
    max_corners: int = 400
    min_quality: float = 0.1
    iterations: int = 20
    precision_pixels: float = 0.05

    def __post_init__(self) -> None:
        require_valid(self, shares=("max_off_wall", "min_quality"))


def main_structure(
    walls: Image,
    points: NDArray[np.intp],
    half: int,
    along_axes: bool = True,
    settings: StructureSettings = StructureSettings(),
) -> Image:
    """Draw the main structure of the walls, a picture of the same size.

    Source: Chen 2021, section 5.5. From the topmost point, the nearest remaining point within the window is linked. The
    link is dropped if too much of the straight line is off the (dilated) ``walls``. Of the others the longer of
    their two legs is drawn, horizontal or vertical, if it is on the wall. The next link starts at its end, so that a
    wall is one straight line. Without a point in the window, a new line starts. A point without a link is a pillar,
    drawn as a square of a tile's size. ``along_axes`` is False for a building without a main direction: links are then
    drawn as they run.
    """
    window = settings.reach_tiles * (2 * half + 1)
    return np.asarray(_linked(walls, points, window, half, along_axes, settings.max_off_wall), np.uint8)


def corners(structure: Image, half: int, settings: StructureSettings = StructureSettings()) -> NDArray[np.float64]:
    """Detect pixels (N, 2) u, v, strongest first, at which lines of the main structure meet, bend or end.

    Chen 2021 uses SIFT and drops keypoints off the walls. On lines of one pixel SIFT also marks blobs between them; the
    corner detector of Shi and Tomasi 1994 marks corners alone. Its window and the least distance of two corners follow
    the size of a tile, 2 ``half`` + 1.
    """
    tile = 2 * half + 1
    margin = 2 * tile + 5  # what the refinement needs around its window
    lines = cv2.dilate(np.pad(structure, margin), np.ones((3, 3), np.uint8))
    found = cv2.goodFeaturesToTrack(lines, settings.max_corners, settings.min_quality, 2 * tile, blockSize=2 * tile + 1)
    if found is None:
        return np.empty((0, 2))
    stop = cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, settings.iterations, settings.precision_pixels
    sharp = cv2.cornerSubPix(lines, found.copy(), (tile, tile), (-1, -1), stop)
    near = np.abs(sharp - found).max(axis=-1, keepdims=True) <= 2 * tile
    return np.where(near, sharp, found)[:, 0].astype(np.float64) - margin


@njit(cache=True)
def _linked(
    walls: NDArray[np.uint8], points: NDArray[np.intp], window: int, half: int, along_axes: bool, max_off_wall: float
) -> NDArray[np.uint8]:
    drawn = np.zeros_like(walls)
    count = len(points)
    left, linked = np.ones(count, np.bool_), np.zeros(count, np.bool_)
    for first in range(count):
        here = first
        if not left[first]:
            continue
        left[first] = False
        u, v = points[first, 0], points[first, 1]
        while True:
            there = _nearest(points, left, u, v, window)
            if there < 0:
                break
            left[there] = False
            next_u, next_v = points[there, 0], points[there, 1]
            if _on_wall(walls, u, v, next_u, next_v) >= 1.0 - max_off_wall:
                end_u, end_v = next_u, next_v
                if along_axes:
                    if abs(next_u - u) >= abs(next_v - v):
                        end_v = v
                    else:
                        end_u = u
                if _on_wall(walls, u, v, end_u, end_v) == 1.0:
                    _line(drawn, u, v, end_u, end_v)
                    linked[here] = linked[there] = True
                    next_u, next_v = end_u, end_v
            here, u, v = there, next_u, next_v
    for k in range(count):
        if not linked[k]:
            _square(drawn, points[k, 0], points[k, 1], half)
    return drawn


@njit(cache=True)
def _nearest(points: NDArray[np.intp], left: NDArray[np.bool_], u: int, v: int, window: int) -> int:
    best, found = np.inf, -1
    for k in range(np.searchsorted(points[:, 1], v - window), len(points)):  # they are sorted by v
        du, dv = points[k, 0] - u, points[k, 1] - v
        if dv > window:
            break
        if left[k] and abs(du) <= window and abs(dv) <= window and du * du + dv * dv < best:
            best, found = du * du + dv * dv, k
    return found


@njit(cache=True)
def _on_wall(walls: NDArray[np.uint8], u: int, v: int, end_u: int, end_v: int) -> float:
    steps = max(abs(end_u - u), abs(end_v - v), 1)
    on = 0
    for k in range(steps + 1):
        col, row = round(u + k * (end_u - u) / steps), round(v + k * (end_v - v) / steps)
        if walls[int(row), int(col)] != 0:
            on += 1
    return on / (steps + 1)


@njit(cache=True)
def _line(drawn: NDArray[np.uint8], u: int, v: int, end_u: int, end_v: int) -> None:
    steps = max(abs(end_u - u), abs(end_v - v), 1)
    for k in range(steps + 1):
        col, row = round(u + k * (end_u - u) / steps), round(v + k * (end_v - v) / steps)
        drawn[int(row), int(col)] = WALL


@njit(cache=True)
def _square(drawn: NDArray[np.uint8], u: int, v: int, half: int) -> None:
    for row in range(max(0, v - half), min(drawn.shape[0], v + half + 1)):
        for col in range(max(0, u - half), min(drawn.shape[1], u + half + 1)):
            if abs(row - v) == half or abs(col - u) == half:
                drawn[row, col] = WALL
