"""Score of one footprint placed over another, and upper bounds of it for whole blocks of shifts at once.

With h hits and m misses of W walls the score is ``(h / (h + m))^2 sqrt(h / W)``. It grows with h and falls with m. To
reach a score a, a placement needs h_a = a^2 W hits, and h hits allow at most g_a(h) = h ((h / W)^(1/4) / sqrt(a) - 1)
misses. Since g_a is convex, it lies below its chord up to the largest possible number of hits, h_max. So for any
p >= 0 a score a needs

    h - p m >= min(h_a, h_max - p g_a(h_max)).

The left side is linear in what is counted, so correlations find it for all shifts. For a block of shifts they bound
it, if each wall counts for its block of cells and each cell has the best label around it.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

MISS, NEUTRAL, HIT = 0, 1, 2
"""Label of a cell: a wall of the other footprint there contradicts, counts nothing, or matches.

A larger label never scores worse.
"""

SIZE_STEP = 12
"""Transforms have sizes that are multiples of this, so that few different ones are needed."""

MAX_PENALTY = 10.0
"""Penalty if no misses are allowed; any large number gives a valid bound."""


@njit(cache=True)
def wall_agreement(hits: int, misses: int, total_walls: float) -> float:
    """Score ``(hits / (hits + misses))^2 sqrt(hits / walls)``, with one more miss against division by zero."""
    return (hits / (hits + misses + 1.0)) ** 2 * math.sqrt(hits / total_walls)


@njit(cache=True)
def wall_agreement_at(
    fixed_walls: NDArray[np.int64],
    fixed_labels: NDArray[np.uint8],
    moving_walls: NDArray[np.int64],
    moving_labels: NDArray[np.uint8],
    total_walls: float,
    row: int,
    col: int,
) -> float:
    """Score the placement that puts the moving footprint's cell (0, 0) on the fixed one's cell ``row``, ``col``.

    Walls are (N, 2) row, col in their own footprint's cells, which are (rows, cols) uint8.
    """
    hits, misses = _hits_and_misses(moving_walls, fixed_labels, row, col)
    back_hits, back_misses = _hits_and_misses(fixed_walls, moving_labels, -row, -col)
    return wall_agreement(hits + back_hits, misses + back_misses, total_walls)


@njit(cache=True)
def _hits_and_misses(walls: NDArray[np.int64], labels: NDArray[np.uint8], row: int, col: int) -> tuple[int, int]:
    hits, misses = 0, 0
    for k in range(walls.shape[0]):
        i, j = walls[k, 0] + row, walls[k, 1] + col
        if 0 <= i < labels.shape[0] and 0 <= j < labels.shape[1]:
            hits += labels[i, j] == HIT
            misses += labels[i, j] == MISS
    return hits, misses


class AgreementBound:
    """Bounds ``h - p m`` of a fixed footprint in several rotations: walls (N, 2) and labels (rows, cols) of each."""

    def __init__(self, fixed: list[tuple[NDArray[np.int64], NDArray[np.uint8]]], block: int, penalty: float) -> None:
        self.block = block
        self.penalty = penalty
        self._values = np.zeros(3, np.float32)
        self._values[MISS], self._values[NEUTRAL], self._values[HIT] = -penalty, 0.0, 1.0
        # A block of cells all around: a cell beyond the rim may be the best of some cells on it.
        padded = [(walls + block, np.pad(labels, block, constant_values=NEUTRAL)) for walls, labels in fixed]
        self._fixed = [(walls, self._best_around(labels, block - 1)) for walls, labels in padded]
        self._blocks = max(max(cells.shape) for _, cells in self._fixed)
        self._spectra: dict[tuple[int, int], list[NDArray[np.complex64]]] = {}

    def _best_around(self, labels: NDArray[np.uint8], first: int) -> NDArray[np.uint8]:
        """Return the best label less than ``block`` cells from every ``block``-th cell, from ``first`` on."""
        width = 2 * self.block - 1
        best = cv2.dilate(labels, np.ones((width, width), np.uint8)) if width > 1 else labels
        return np.asarray(best, np.uint8)[first :: self.block, first :: self.block]

    def over_blocks(self, walls: NDArray[np.int64], labels: NDArray[np.uint8]) -> list[NDArray[np.float32]]:
        """Bound each block of shifts (rows, cols), cyclic, of a moving footprint over each rotation of the fixed one.

        Entry [i, j] holds for the ``block`` x ``block`` shifts from (i - 1, j - 1) blocks on, by which the moving
        footprint's cell (0, 0) lies from the fixed one's.
        """
        cells = self._best_around(labels, 0)
        rows, cols = (_transform_size(self._blocks + size + 1) for size in cells.shape)
        spectrum = self._spectrum(cells, walls, (rows, cols), fixed=False).conj()
        if (rows, cols) not in self._spectra:
            self._spectra[rows, cols] = [
                self._spectrum(around, fixed_walls, (rows, cols), fixed=True) for fixed_walls, around in self._fixed
            ]
        return [_real_part(each * spectrum) for each in self._spectra[rows, cols]]

    def _spectrum(
        self, cells: NDArray[np.uint8], walls: NDArray[np.int64], shape: tuple[int, int], fixed: bool
    ) -> NDArray[np.complex64]:
        """Transform walls + i cells of the moving footprint, or cells + i walls of the fixed one.

        The real part of their correlation is walls on cells plus cells on walls: both sums by one transform.
        """
        packed = np.zeros((*shape, 2), np.float32)
        _pack(packed, cells, self._values, walls, self.block, fixed)
        return np.asarray(cv2.dft(packed)).view(np.complex64)[..., 0]


def _transform_size(least: int) -> int:
    return cv2.getOptimalDFTSize(-(-least // SIZE_STEP) * SIZE_STEP)


def _real_part(spectrum: NDArray[np.complex64]) -> NDArray[np.float32]:
    parts = spectrum.view(np.float32).reshape(*spectrum.shape, 2)
    return np.asarray(cv2.dft(parts, flags=cv2.DFT_INVERSE | cv2.DFT_SCALE), np.float32)[..., 0]


@njit(cache=True)
def _pack(
    packed: NDArray[np.float32],
    cells: NDArray[np.uint8],
    values: NDArray[np.float32],
    walls: NDArray[np.int64],
    block: int,
    fixed: bool,
) -> None:
    on_labels, on_walls = (0, 1) if fixed else (1, 0)
    for i in range(cells.shape[0]):
        for j in range(cells.shape[1]):
            packed[i, j, on_labels] = values[cells[i, j]]
    for k in range(walls.shape[0]):
        packed[walls[k, 0] // block, walls[k, 1] // block, on_walls] += 1.0


@njit(cache=True)
def least_bound(score: float, penalty: float, max_hits: float, total_walls: float) -> float:
    """Return the least ``h - p m`` of any placement that reaches the score."""
    if score <= 0.0:
        return 0.0
    allowed_misses = max_hits * ((max_hits / total_walls) ** 0.25 / math.sqrt(score) - 1.0)
    least: float = min(score**2 * total_walls, max_hits - penalty * allowed_misses)
    return least


def tightest_penalty(score: float, max_hits: float, total_walls: float) -> float:
    """Return the p whose bound leaves the fewest placements that may reach the score: the slope of the chord."""
    allowed_misses = max_hits * ((max_hits / total_walls) ** 0.25 / math.sqrt(score) - 1.0)
    needed = score**2 * total_walls
    return (max_hits - needed) / allowed_misses if allowed_misses > 0.0 else MAX_PENALTY
