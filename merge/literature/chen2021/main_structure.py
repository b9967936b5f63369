"""Step 5.5: reduce walls to one-pixel polylines along rows and columns, pillars to small squares."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from merge.literature.chen2021.binarisation import WALL, Image

TILES_AWAY = 4
"""The next point is sought within so many tiles: Chen's 20 pixels, where L is 2."""

MOST_OFF_WALL = 0.5


def link_window(half: int) -> int:
    """Return the largest distance [pixels] in u and in v of the next point of a wall; a tile is 2 ``half`` + 1 wide."""
    return TILES_AWAY * (2 * half + 1)


def main_structure(walls: Image, points: NDArray[np.intp], half: int, along_axes: bool = True) -> Image:
    """Draw the main structure of the walls, a picture of the same size.

    Source: Chen 2021, section 5.5. From the topmost point, the nearest remaining point within the window is linked. The
    link is dropped if more than half of the straight line is off the (dilated) ``walls``. Of the others the longer of
    their two legs is drawn, horizontal or vertical, if it is on the wall. The next link starts at its end, so that a
    wall is one straight line. Without a point in the window, a new line starts. A point without a link is a pillar,
    drawn as a square of a tile's size. ``along_axes`` is False for a building without a main direction: links are then
    drawn as they run.
    """
    return np.asarray(_linked(walls, points, link_window(half), half, along_axes), np.uint8)


@njit(cache=True)
def _linked(
    walls: NDArray[np.uint8], points: NDArray[np.intp], window: int, half: int, along_axes: bool
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
            if _on_wall(walls, u, v, next_u, next_v) >= 1.0 - MOST_OFF_WALL:
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
