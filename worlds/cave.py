"""A cave."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage import measure, morphology

from mapping.arrays import frozen_array
from worlds.layout import Layout, require_size
from worlds.polygon import Polygon, signed_area

CELL = 0.1
"""Cells on which the cave is grown [m]."""
STEP = 0.3
"""Grid on which its outline is drawn [m]: no side of the rock is longer than this grid's diagonal."""
RIM = 1.2
"""How far the rock grows in from the border [m]; half of that it always does."""
WAY = 0.6
"""Half the width of the narrowest way that is kept [m]."""
LEAST_ROCK = 0.5
"""Rock that stands alone and is smaller than this [m^2] is left out."""
LAP = 1e-4
"""How far the halves of the rock reach over the line between them [m], so that no ray passes."""


def cave(rng: np.random.Generator, width: float = 40.0, height: float = 40.0) -> Layout:
    """Draw a cave of ``width`` x ``height`` [m]: chambers, ways over 1 m wide and boulders, nowhere a straight line.

    The rock is smoothed noise above a threshold. It is drawn in a left and a right half, as rock around a hollow is no
    simple polygon: only their sides in the rock and on the world's border are straight. Raises ``ValueError`` below
    12 x 12 m.
    """
    require_size("cave", width, height, (12.0, 12.0))
    shape = (round(height / CELL) + 1, round(width / CELL) + 1)
    hollow = _hollow(rng, shape)
    while hollow.mean() < 0.36:
        hollow = _hollow(rng, shape)
    rows, cols = round(height / STEP) + 1, round(width / STEP) + 1
    y, x = np.meshgrid(np.linspace(0, shape[0] - 1, rows), np.linspace(0, shape[1] - 1, cols), indexing="ij")
    rock = ndimage.gaussian_filter((~hollow).astype(np.float64), 0.25 / CELL)
    field = ndimage.map_coordinates(rock, (y, x), order=1) - 0.5
    return Layout(tuple(_outlines(field, (width, height))))


def _hollow(rng: np.random.Generator, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """The largest hollow of a noise, wide enough to drive in everywhere; what is left of the rest is rock."""
    noise = sum(
        (weight * _unit(ndimage.gaussian_filter(rng.normal(size=shape), sigma / CELL)) for weight, sigma in _OCTAVES),
        start=np.zeros(shape),
    )
    to_border = ndimage.distance_transform_edt(np.pad(np.ones(shape, dtype=np.bool_), 1))[1:-1, 1:-1] * CELL
    noise += 5.0 * np.exp(-to_border / RIM)
    free = (noise < np.quantile(noise, 0.58)) & (to_border > RIM / 2.0)
    disc = morphology.disk(round(WAY / CELL))  # type: ignore[no-untyped-call]
    labels, count = ndimage.label(ndimage.binary_erosion(free, disc))
    if count == 0:
        return np.zeros(shape, dtype=np.bool_)
    largest = 1 + int(np.argmax(np.bincount(labels.ravel())[1:]))
    opened = ndimage.binary_dilation(labels == largest, disc)
    least = round(LEAST_ROCK / CELL**2)
    stones, _ = ndimage.label(~opened)
    small = np.bincount(stones.ravel()) < least
    return np.asarray(opened | small[stones])


_OCTAVES = ((1.0, 1.5), (0.35, 0.6))
"""Weight and width [m] of the noises that are added."""


def _unit(noise: NDArray[np.float64]) -> NDArray[np.float64]:
    unit: NDArray[np.float64] = (noise - noise.mean()) / noise.std()
    return unit


def _outlines(field: NDArray[np.float64], size: tuple[float, float]) -> list[Polygon]:
    """Where the field, (rows, cols) over the world, is positive: simple polygons, cut at the column in the middle."""
    rows, cols = field.shape
    scale = np.array((size[0] / (cols - 1), size[1] / (rows - 1)))
    cut = _cut_column(field)
    outlines = []
    for first, stop in ((0, cut + 1), (cut, cols)):
        walled = np.pad(field[:, first:stop], 1, constant_values=-1e9)
        low, high = np.array((first, 0)) * scale, np.array((stop - 1, rows - 1)) * scale
        lap = np.array((LAP, 0.0))
        contours = measure.find_contours(walled, 0.0)  # type: ignore[no-untyped-call]
        for contour in contours:
            corners = (contour[:-1, ::-1] - 1.0 + (first, 0)) * scale
            corners = np.where(corners < low + LAP, low - lap, np.where(corners > high - LAP, high + lap, corners))
            polygon = _tidy(np.clip(corners, 0.0, size))
            if len(polygon) >= 3 and abs(signed_area(polygon)) >= 0.05:
                outlines.append(frozen_array(polygon if signed_area(polygon) > 0.0 else polygon[::-1], np.float64))
    return outlines


def _cut_column(field: NDArray[np.float64]) -> int:
    """A column near the middle; every hollow of both halves then reaches it, or rock would have a hole."""
    middle = field.shape[1] // 2
    return next(
        column
        for column in sorted(range(1, field.shape[1] - 1), key=lambda each: abs(each - middle))
        if (field[:, column] < 0.0).any()
    )


def _tidy(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Without corners that repeat, nor those on a straight line between their neighbours."""
    corners = corners[np.hypot(*(np.roll(corners, -1, axis=0) - corners).T) > 1e-6]
    ahead, behind = np.roll(corners, -1, axis=0) - corners, corners - np.roll(corners, 1, axis=0)
    return corners[np.abs(behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0]) > 1e-9]
