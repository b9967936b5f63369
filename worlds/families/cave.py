"""Generate caves."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage
from skimage import measure, morphology

from mapping.arrays import frozen_array
from worlds.building.drawing import WorldDrawing, require_size
from worlds.polygon import Polygon, signed_area

CELL = 0.1
"""Cell size of the noise field [m]."""
STEP = 0.3
"""Cell size of the grid on which the outline is traced [m]: no side of the rock is longer than its diagonal."""
RIM = 1.2
"""Thickness of the rock along the border [m]; at least half of it is always solid."""
WAY = 0.6
"""Half the least width of passages [m]."""
ROUGH = 0.05
"""Roughness of the walls: standard deviation of the noise on a field that rises from 0 to 1 within half a metre."""
LEAST_ROCK = 0.5
"""Smallest area of a boulder [m^2]; half of it after smoothing."""
THINNEST = 0.3
"""Least thickness of a half of the rock where it is cut [m]."""
LAP = 1e-4
"""Overlap of the two halves of the rock [m], so that no ray passes between them."""


def cave(rng: np.random.Generator, width: float = 40.0, height: float = 40.0) -> WorldDrawing:
    """Draw a cave of ``width`` x ``height`` [m]: chambers, passages over 1 m wide and boulders, without straight walls.

    The rock is smoothed noise above a threshold. The rock around the free floor is not a simple polygon, so it is drawn
    in two halves; only the sides along the cut and the world's border are straight. Raises ``ValueError`` below 12 x 12
    m.
    """
    require_size("cave", width, height, (12.0, 12.0))
    shape = (round(height / CELL) + 1, round(width / CELL) + 1)
    hollow = _hollow(rng, shape)
    while hollow.mean() < 0.36:
        hollow = _hollow(rng, shape)
    rows, cols = round(height / STEP) + 1, round(width / STEP) + 1
    y, x = np.meshgrid(np.linspace(0, shape[0] - 1, rows), np.linspace(0, shape[1] - 1, cols), indexing="ij")
    rock = ndimage.gaussian_filter((~hollow).astype(np.float64), 0.25 / CELL)
    rock += ROUGH * _unit(ndimage.gaussian_filter(rng.normal(size=shape), 0.4 / CELL))
    field = ndimage.map_coordinates(rock, (y, x), order=1) - 0.5
    return WorldDrawing(tuple(_outlines(field, (width, height))))


def _hollow(rng: np.random.Generator, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Draw noise and return the largest connected free area that is wide enough for robots; the rest is rock."""
    noise = sum(
        (weight * _unit(ndimage.gaussian_filter(rng.normal(size=shape), sigma / CELL)) for weight, sigma in _OCTAVES),
        start=np.zeros(shape),
    )
    to_border = ndimage.distance_transform_edt(np.pad(np.ones(shape, dtype=np.bool_), 1))[1:-1, 1:-1] * CELL
    noise += 9.0 * np.exp(-to_border / RIM)
    free = (noise < np.quantile(noise, 0.56)) & (to_border > RIM / 2.0)
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
"""Weight and width [m] of the summed noises."""


def _unit(noise: NDArray[np.float64]) -> NDArray[np.float64]:
    unit: NDArray[np.float64] = (noise - noise.mean()) / noise.std()
    return unit


def _outlines(field: NDArray[np.float64], size: tuple[float, float]) -> list[Polygon]:
    """Trace where the field (rows, cols) over the world is positive: boulders as a whole, the surrounding rock in two
    halves."""
    labels, _ = ndimage.label(field > 0.0)
    around = labels == labels[0, 0]
    scale = np.array((size[0] / (field.shape[1] - 1), size[1] / (field.shape[0] - 1)))
    boulders = _contours(np.where(around, -np.abs(field), field), np.zeros(2), scale)
    boulders = [each for each in boulders if signed_area(each) >= LEAST_ROCK / 2.0]
    rock = np.where(around, field, -np.abs(field))
    middle = field.shape[1] / 2.0
    cuts = [column for column in range(1, field.shape[1] - 1) if (rock[:, column] < 0.0).any()]
    halves: list[Polygon] = []
    for cut in sorted(cuts, key=lambda column: abs(column - middle)):
        halves = _halves(rock, cut, scale, size)
        if all(np.ptp(half, axis=0).min() >= THINNEST for half in halves):
            break
    return boulders + halves


def _halves(
    rock: NDArray[np.float64], cut: int, scale: NDArray[np.float64], size: tuple[float, float]
) -> list[Polygon]:
    """Trace the rock left and right of a column that passes through the free area, so that neither half has a hole."""
    outlines = []
    lap = np.array((LAP, 0.0))
    for first, stop in ((0, cut + 1), (cut, rock.shape[1])):
        low, high = np.array((first, 0)) * scale, np.array((stop - 1, len(rock) - 1)) * scale
        for corners in _contours(np.pad(rock[:, first:stop], 1, constant_values=-1e9), (first - 1.0, -1.0), scale):
            moved = np.where(corners < low + LAP, low - lap, np.where(corners > high - LAP, high + lap, corners))
            outlines.append(frozen_array(_tidy(np.clip(moved, 0.0, size)), np.float64))
    return outlines


def _contours(field: NDArray[np.float64], first: ArrayLike, scale: NDArray[np.float64]) -> list[Polygon]:
    """Trace the positive areas counter-clockwise [m]; ``first`` is the column and row of cell (0, 0)."""
    contours = measure.find_contours(field, 0.0)  # type: ignore[no-untyped-call]
    polygons = [_tidy((contour[:-1, ::-1] + np.asarray(first)) * scale) for contour in contours]
    return [frozen_array(each if signed_area(each) > 0.0 else each[::-1], np.float64) for each in polygons]


def _tidy(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Remove repeated corners and corners on a straight line between their neighbours."""
    corners = corners[np.hypot(*(np.roll(corners, -1, axis=0) - corners).T) > 1e-6]
    ahead, behind = np.roll(corners, -1, axis=0) - corners, corners - np.roll(corners, 1, axis=0)
    return corners[np.abs(behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0]) > 1e-9]
