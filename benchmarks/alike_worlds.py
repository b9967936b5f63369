"""Worlds of equal rooms, niches and columns, each with the path of a robot that comes by again and again."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mapping.robot.trajectory import Trajectory
from worlds.polygon import Polygon, box
from worlds.world import World

Route = list[tuple[float, float]]
"""Corners x, y [m] of a path."""


def niches(rng: np.random.Generator) -> tuple[World, Route]:
    """Draw a ring of corridors: two long sides without a feature, two short ones with equal niches every 1.5 m."""
    return _ring(lambda: True, (0.0, 1.5, 0.0, 1.5))


def missing_niches(rng: np.random.Generator) -> tuple[World, Route]:
    """Draw a ring of corridors with niches every 1.5 m, of which three in ten are walled up."""
    return _ring(lambda: rng.random() < 0.7, (0.0, 1.5, 0.0, 1.5))


def columns(rng: np.random.Generator) -> tuple[World, Route]:
    """Draw a hall of equal columns every 2.5 m, and a path to and fro between its rows."""
    size, pitch = 24.0, 2.5
    standing = np.arange(pitch, size - 1.0, pitch)
    posts = [box(x - 0.2, y - 0.2, x + 0.2, y + 0.2) for x in standing for y in standing]
    lanes = (standing[:-1] + standing[1:])[::2] / 2.0
    route: Route = []
    for number, y in enumerate(lanes.tolist()):
        ends = (1.2, size - 1.2) if number % 2 == 0 else (size - 1.2, 1.2)
        route += [(ends[0], y), (ends[1], y)]
    back = [(lanes[-1], route[-1][1]), (lanes[-1], lanes[0]), (1.2, lanes[0])]
    return World("columns", 0, (size, size), (*_rim(size, size, 0.3), *posts)), [*route, *back]


def rooms(rng: np.random.Generator) -> tuple[World, Route]:
    """Draw a long corridor with equal rooms on both sides, and a path that enters every other one."""
    pitch, depth, way, count, door = 4.0, 3.4, 2.0, 7, 1.1
    width, height = count * pitch + 0.4, 2.0 * depth + way + 1.0
    low, high = 0.3 + depth, 0.3 + depth + way + 0.4
    walls: list[Polygon] = [*_rim(width, height, 0.2)]
    route: Route = [(0.9, 0.5 * height)]
    for k in range(count):
        x0, x1 = 0.2 + k * pitch, 0.2 + (k + 1) * pitch
        middle = 0.5 * (x0 + x1)
        for y in (low, high):
            walls += [box(x0, y - 0.1, middle - door / 2.0, y + 0.1), box(middle + door / 2.0, y - 0.1, x1, y + 0.1)]
        if k:
            walls += [box(x0 - 0.1, 0.2, x0 + 0.1, low), box(x0 - 0.1, high, x0 + 0.1, height - 0.2)]
        inside = 1.6 if k % 2 else height - 1.6
        route += [(middle, 0.5 * height), (middle, inside), (middle, 0.5 * height)]
    return World("rooms", 0, (width, height), tuple(walls)), [*route, (width - 1.0, 0.5 * height), *route[::-1][:-1]]


WORLDS: dict[str, Callable[[np.random.Generator], tuple[World, Route]]] = {
    "niches": niches,
    "missing_niches": missing_niches,
    "columns": columns,
    "rooms": rooms,
}


def drive(route: Sequence[tuple[float, float]], rounds: int, speed: float, turn_rate: float, rate: float) -> Trajectory:
    """Drive a closed route at ``speed`` [m/s], turning in place at ``turn_rate`` [rad/s]; ``rate`` poses a second."""
    corners = [np.array(each) for each in [*list(route) * rounds, route[0]]]
    poses: list[tuple[float, float, float]] = []
    heading = math.atan2(*(corners[1] - corners[0])[::-1])
    for here, there in pairwise(corners):
        length = math.dist(here, there)
        if length == 0.0:
            continue
        turn = math.remainder(math.atan2(*(there - here)[::-1]) - heading, math.tau)
        turns, steps = math.ceil(abs(turn) * rate / turn_rate), math.ceil(length * rate / speed)
        poses += [(*here, heading + turn * k / turns) for k in range(turns)]
        heading += turn
        poses += [(*(here + (there - here) * k / steps), heading) for k in range(steps)]
    return Trajectory(np.arange(len(poses)) / rate, np.array(poses))


def _rim(width: float, height: float, thick: float) -> list[Polygon]:
    return [
        box(0.0, 0.0, width, thick),
        box(0.0, height - thick, width, height),
        box(0.0, thick, thick, height - thick),
        box(width - thick, thick, width, height - thick),
    ]


def _ring(present: Callable[[], bool], pitches: Sequence[float]) -> tuple[World, Route]:
    """Draw a ring of corridors 2 m wide around a block; side k has niches every ``pitches[k]`` [m], 0 for none."""
    width, height, rim, way = 26.0, 14.0, 1.0, 2.0
    outside = _rectangle(0.0, 0.0, width, height)
    outer, inner = (_rectangle(m, m, width - m, height - m) for m in (rim, rim + way))
    slabs = []
    for k in range(4):
        start, end = outer[k], outer[(k + 1) % 4]
        face = [*_side(start, end, -1.0, pitches[k], present), end]
        slabs.append(np.array([outside[k], outside[(k + 1) % 4], *face[::-1]]))
    block = [corner for k in range(4) for corner in _side(inner[k], inner[(k + 1) % 4], 1.0, pitches[k], present)]
    middle = rim + 0.5 * way
    route = [(float(x), float(y)) for x, y in _rectangle(middle, middle, width - middle, height - middle)]
    return World("ring", 0, (width, height), (*slabs, np.array(block))), route


def _rectangle(x0: float, y0: float, x1: float, y1: float) -> NDArray[np.float64]:
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


def _side(
    start: NDArray[np.float64], end: NDArray[np.float64], inward: float, pitch: float, present: Callable[[], bool]
) -> list[NDArray[np.float64]]:
    """Return the corners of a wall from ``start`` to before ``end``, with niches 0.6 m wide and 0.4 m deep to its left
    (``inward`` 1) or right (-1)."""
    wide, deep = 0.6, 0.4
    length = math.dist(start, end)
    along = (end - start) / length
    depth = inward * deep * np.array([-along[1], along[0]])
    corners = [start]
    if pitch == 0.0:
        return corners
    number = int((length - wide - 0.4) / pitch)
    first = 0.5 * (length - number * pitch - wide)
    for k in range(number + 1):
        if present():
            left, right = start + (first + k * pitch) * along, start + (first + k * pitch + wide) * along
            corners += [left, left + depth, right + depth, right]
    return corners
