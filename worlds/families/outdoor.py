"""Generate parks."""

from __future__ import annotations

import math

import numpy as np

from mapping.arrays import frozen_array
from worlds.building.drawing import WorldDrawing, require_size
from worlds.building.scatter import blob, scattered
from worlds.polygon import Polygon, contains, disc, distances, edges, turned_box

PASSAGE = 1.0
"""Least gap between objects [m]."""


def outdoor(rng: np.random.Generator, width: float = 60.0, height: float = 60.0) -> WorldDrawing:
    """Draw a park of ``width`` x ``height`` [m]: trees as cylinders, bushes, rocks, benches and a shed; no walls.

    Robots stay inside a fence, an irregular polygon that no lidar sees; objects beyond it are visible. Raises
    ``ValueError`` below 15 x 15 m.
    """
    require_size("outdoor", width, height, (15.0, 15.0))
    fence = _fence(rng, width, height)
    pieces = _built(rng, width, height) + _groves(rng, width, height) + _growth(rng, width, height)
    pieces = [piece for piece in pieces if _gap_to_fence(piece, fence) >= PASSAGE]
    return WorldDrawing(tuple(scattered(pieces, (), PASSAGE)), fence=fence)


def _gap_to_fence(piece: Polygon, fence: Polygon) -> float:
    """Return the distance of a piece from the fence [m], 0 if they intersect. The fence's corners are farther apart
    than a piece is wide."""
    if contains(fence, piece).any() and not contains(fence, piece).all():
        return 0.0
    return float(distances(edges(fence), piece).min())


def _fence(rng: np.random.Generator, width: float, height: float, corners: int = 14) -> Polygon:
    """Draw a polygon about 2 to 6 m inside the border."""
    angles = math.tau * (np.arange(corners) + rng.uniform(-0.25, 0.25, corners)) / corners
    direction = np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    half = np.array((width, height)) / 2.0
    to_border = (half / np.maximum(np.abs(direction), 1e-9)).min(axis=1)
    inset = rng.uniform(0.05, 0.14, corners) * min(width, height)
    reach = np.minimum(to_border, 1.15 * min(width, height) / 2.0 * (max(width, height) / min(width, height))) - inset
    return frozen_array(half + direction * reach[:, None], np.float64)


def _built(rng: np.random.Generator, width: float, height: float) -> list[Polygon]:
    """Draw a shed and benches."""
    x, y = (float(each) for each in rng.uniform((0.25, 0.25), (0.75, 0.75)) * (width, height))
    pieces = [turned_box(x, y, rng.uniform(3.0, 5.0), rng.uniform(2.5, 3.5), rng.uniform(0.0, math.pi))]
    for _ in range(int(width * height / 300.0)):
        x, y = (float(each) for each in rng.uniform((2.0, 2.0), (width - 2.0, height - 2.0)))
        pieces.append(turned_box(x, y, 1.6, 0.5, rng.uniform(0.0, math.pi)))
    return pieces


def _groves(rng: np.random.Generator, width: float, height: float) -> list[Polygon]:
    """Draw trees, two in three of them in groves."""
    count = int(width * height / 22.0)
    centres = rng.uniform((0.0, 0.0), (width, height), (max(2, count // 18), 2))
    pieces = []
    for _ in range(count):
        x, y = rng.uniform((0.6, 0.6), (width - 0.6, height - 0.6))
        if rng.random() < 0.66:
            x, y = centres[int(rng.integers(len(centres)))] + rng.normal(0.0, 3.5, 2)
        radius = float(np.clip(rng.lognormal(math.log(0.2), 0.4), 0.1, 0.5))
        if radius < x < width - radius and radius < y < height - radius:
            pieces.append(disc(float(x), float(y), radius, 20))
    return pieces


def _growth(rng: np.random.Generator, width: float, height: float) -> list[Polygon]:
    """Draw bushes and rocks."""
    pieces = []
    for _ in range(int(width * height / 70.0)):
        radius = rng.uniform(0.3, 1.2)
        x, y = rng.uniform((radius, radius), (width - radius, height - radius))
        pieces.append(blob(rng, float(x), float(y), radius))
    return pieces
