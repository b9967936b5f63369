"""Correlation of the walls and normals of two maps over all shifts at once, by Fourier transform."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import fft

from mapping.geometry.similarity2 import Similarity2
from mapping.validation import require_valid
from merge.preparation.correlation_pyramid import CorrelationPyramid

BLOCK = 8
"""Side of the blocks of cells of which one is a candidate for a peak."""

SAME_YAW = 1e-9
"""Yaws [rad] that differ by less are equal up to rounding."""

Spectrum = NDArray[np.complex64]


@dataclass(frozen=True)
class Peak:
    """A local maximum of the correlation, from cells of the source to cells of the target."""

    target_from_source: Similarity2
    score: float


@dataclass(frozen=True)
class CorrelationSettings:
    """Correlation of the walls of two maps over all shifts.

    - ``cells``: cells of the raster along the larger map;
    - ``peaks``: best shifts of each scale and rotation;
    - ``contradiction``: cost of a wall deep in the other map's free space, per cell of length;
    - ``normal_weight``, ``wall_weight``: chosen so that a wall on a wall of the same orientation gains 1 per cell of
      length, and 0.1 whatever its orientation;
    - ``blur_cells``: standard deviation of the Gaussian that blurs free space and walls, in cells of the raster;
    - ``padding_share``: rasters are padded by this share of the smaller map; the rest wraps around.
    """

    cells: int = 112
    peaks: int = 4
    contradiction: float = 0.35
    normal_weight: float = 1.9
    wall_weight: float = 0.43
    blur_cells: float = 1.2
    padding_share: float = 0.4

    def __post_init__(self) -> None:
        require_valid(self, not_negative=("contradiction", "wall_weight", "padding_share"))


def correlate(
    target: CorrelationPyramid,
    source: CorrelationPyramid,
    scale: float,
    yaws: Iterable[float],
    settings: CorrelationSettings = CorrelationSettings(),
) -> list[Peak]:
    """Find the best shifts of the source at one scale and each of the yaws [rad].

    The score is the correlation of signed wall normals, plus a little for walls on walls, less the walls of either map
    in the other's free space, over the root of both lengths. Normals are gradients of the blurred free space, and
    correlating gradients is multiplying the spectrum by the squared wave number: one inverse transform gives the sum.
    """
    yaws = list(yaws)
    if not yaws:
        return []
    cell = max(*target.size, *(scale * side for side in source.size)) / settings.cells
    shape = _shape(target, source, scale, yaws, cell, settings.padding_share)
    walls, free = _weights(shape, settings.blur_cells)
    a_free, a_deep, a_wall = _spectra(target, 0.0, cell, shape)
    with_free = settings.normal_weight * free * a_free
    with_deep = -settings.contradiction * walls * a_wall
    with_wall = (
        settings.wall_weight * _blur(shape, settings.blur_cells) * a_wall - settings.contradiction * walls * a_deep
    )
    there, here = target.middle.tolist(), source.middle.tolist()
    peaks = []
    for axis, sides in _axes(yaws).items():
        b_free, b_deep, b_wall = _spectra(source, axis, cell / scale, shape)
        length = math.sqrt(max(1.0, a_wall[0, 0].real) * max(1.0, b_wall[0, 0].real))
        for yaw, turned in sides:
            if turned:
                spectrum = b_free * with_free + b_deep * with_deep + b_wall * with_wall
            else:
                spectrum = b_free.conj() * with_free + b_deep.conj() * with_deep + b_wall.conj() * with_wall
            for row, col, value in _highest(fft.irfft2(spectrum, s=shape).astype(np.float32), settings.peaks):
                x, y = _unwrapped((row + turned) % shape[0], (col + turned) % shape[1], shape)
                found = _similarity(there, here, scale, yaw, (cell * x, cell * y))
                peaks.append(Peak(found, value / length))
    return peaks


def _axes(yaws: Iterable[float]) -> dict[float, list[tuple[float, bool]]]:
    """Group the yaws that are half a turn apart: the first of them, and each with True if it is the other one.

    A raster rotated by half a turn is the raster read backwards. Its spectrum is the conjugate, one cell further on.
    """
    axes: dict[float, list[tuple[float, bool]]] = {}
    for yaw in yaws:
        axis = next((axis for axis in axes if abs(math.remainder(yaw - axis, math.pi)) < SAME_YAW), yaw)
        turned = abs(math.remainder(yaw - axis, math.tau)) > math.pi / 2.0
        axes.setdefault(axis, []).append((yaw, turned))
    return axes


def _similarity(
    there: list[float], here: list[float], scale: float, yaw: float, shift: tuple[float, float]
) -> Similarity2:
    """Return the similarity that puts the middle of the source at ``shift`` from that of the target."""
    c, s = scale * math.cos(yaw), scale * math.sin(yaw)
    x = there[0] + shift[0] - (c * here[0] - s * here[1])
    y = there[1] + shift[1] - (s * here[0] + c * here[1])
    return Similarity2(x, y, yaw, scale)


def _shape(
    target: CorrelationPyramid, source: CorrelationPyramid, scale: float, yaws: list[float], cell: float, padding: float
) -> tuple[int, int]:
    """Choose the raster's rows and columns: both maps fit, and the Fourier transform is fast."""
    sides = []
    for axis in (1, 0):  # rows, columns
        there = target.size[axis] / cell
        here = 0.0
        for yaw in yaws:
            along, across = abs(math.cos(yaw)), abs(math.sin(yaw))
            here = max(here, scale * (along * source.size[axis] + across * source.size[1 - axis]) / cell)
        sides.append(fft.next_fast_len(math.ceil(max(there, here) + padding * min(there, here)) + 4, real=True))
    return sides[0], sides[1]


def _spectra(layers: CorrelationPyramid, yaw: float, cells: float, shape: tuple[int, int]) -> Spectrum:
    spectra: Spectrum = fft.rfft2(layers.resample(yaw, cells, shape), axes=(1, 2))
    return spectra


@lru_cache(maxsize=128)
def _weights(shape: tuple[int, int], blur: float) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    square = _square(shape)
    return np.exp(-0.5 * square * blur**2).astype(np.float32), (square * _blur(shape, blur)).astype(np.float32)


@lru_cache(maxsize=128)
def _blur(shape: tuple[int, int], blur: float) -> NDArray[np.float32]:
    return np.exp(-_square(shape) * blur**2).astype(np.float32)


def _square(shape: tuple[int, int]) -> NDArray[np.float64]:
    rows, cols = math.tau * np.fft.fftfreq(shape[0]), math.tau * np.fft.rfftfreq(shape[1])
    return np.asarray(rows[:, None] ** 2 + cols[None, :] ** 2)


def _unwrapped(row: int, col: int, shape: tuple[int, int]) -> tuple[int, int]:
    rows, cols = shape
    return col - cols if 2 * col > cols else col, row - rows if 2 * row > rows else row


def _highest(surface: NDArray[np.float32], most: int) -> list[tuple[int, int, float]]:
    places, values = _block_maxima(surface)
    best = np.argsort(-values, kind="stable")[:most]
    return [(int(places[k]) // surface.shape[1], int(places[k]) % surface.shape[1], float(values[k])) for k in best]


@njit(cache=True)
def _block_maxima(surface: NDArray[np.float32]) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """List flat indices and values of the cells that are the highest of their block and of their neighbours."""
    rows, cols = surface.shape
    places, values = [], []
    for top in range(0, rows, BLOCK):
        for left in range(0, cols, BLOCK):
            best_row, best_col = top, left
            for row in range(top, min(top + BLOCK, rows)):
                for col in range(left, min(left + BLOCK, cols)):
                    if surface[row, col] > surface[best_row, best_col]:
                        best_row, best_col = row, col
            best = surface[best_row, best_col]
            around = best
            for row in (best_row - 1, best_row, (best_row + 1) % rows):
                for col in (best_col - 1, best_col, (best_col + 1) % cols):
                    around = max(around, surface[row, col])
            if around == best:
                places.append(best_row * cols + best_col)
                values.append(best)
    return np.array(places), np.array(values)
