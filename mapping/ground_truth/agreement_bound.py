"""What two footprints agree by at most, for whole blocks of shifts at once.

Agreement grows with the hits h and falls with the misses m. To reach a value a it needs h_a = a^2 W hits of W walls,
and h hits bear at most g_a(h) = h ((h / W)^(1/4) / sqrt(a) - 1) misses. As g_a is convex it runs below its chord up to
the most hits there can be, h_max, so that for any p >= 0 agreement a takes

    h - p m >= min(h_a, h_max - p g_a(h_max)).

The left side is linear in what is counted: correlations find it for all shifts. For blocks of shifts they bound it,
where each wall counts for its block of cells and each cell says the best that is said around it.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.ground_truth.footprint_layers import DEEP, NEAR, NEITHER
from mapping.ground_truth.rotated_footprint import RotatedFootprint

SIZE_STEP = 12
"""Transforms come in sizes that are multiples of this, so that few different ones are needed."""


class AgreementBound:
    """Bounds ``h - p m`` of a fixed footprint in several facings: walls (N, 2) and what cells say, (rows, cols)."""

    def __init__(self, facings: list[tuple[NDArray[np.int64], NDArray[np.uint8]]], block: int, penalty: float) -> None:
        self.block = block
        self.penalty = penalty
        self._values = np.zeros(3, np.float32)
        self._values[DEEP], self._values[NEITHER], self._values[NEAR] = -penalty, 0.0, 1.0
        # A block of cells all around: a cell past the rim may be the best of some cells on it.
        padded = [(walls + block, np.pad(says, block, constant_values=NEITHER)) for walls, says in facings]
        self._facings = [(walls, self._best_around(says, block - 1)) for walls, says in padded]
        self._blocks = max(max(cells.shape) for _, cells in self._facings)
        self._spectra: dict[tuple[int, int], list[NDArray[np.complex64]]] = {}

    def _best_around(self, says: NDArray[np.uint8], first: int) -> NDArray[np.uint8]:
        """What is best said less than ``block`` cells from every ``block``-th cell, from ``first`` on."""
        width = 2 * self.block - 1
        best = cv2.dilate(says, np.ones((width, width), np.uint8)) if width > 1 else says
        return np.asarray(best, np.uint8)[first :: self.block, first :: self.block]

    def over_blocks(self, moving: RotatedFootprint) -> list[NDArray[np.float32]]:
        """For each facing, the bound of each block of shifts (rows, cols), cyclic.

        Entry [i, j] is for the ``block`` x ``block`` shifts from (i - 1, j - 1) blocks on by which the moving
        footprint's cell (0, 0) lies from the fixed one's.
        """
        cells = self._best_around(moving.says, 0)
        rows, cols = (_transform_size(self._blocks + size + 1) for size in cells.shape)
        turned = self._spectrum(cells, moving.walls, (rows, cols), fixed=False).conj()
        if (rows, cols) not in self._spectra:
            self._spectra[rows, cols] = [
                self._spectrum(around, walls, (rows, cols), fixed=True) for walls, around in self._facings
            ]
        return [_real_part(spectrum * turned) for spectrum in self._spectra[rows, cols]]

    def _spectrum(
        self, cells: NDArray[np.uint8], walls: NDArray[np.int64], shape: tuple[int, int], fixed: bool
    ) -> NDArray[np.complex64]:
        """Walls + i cells of the moving footprint, cells + i walls of the fixed one: the real part of their
        correlation is walls on cells plus cells on walls, both sums by one transform."""
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
    says, counts = (0, 1) if fixed else (1, 0)
    for i in range(cells.shape[0]):
        for j in range(cells.shape[1]):
            packed[i, j, says] = values[cells[i, j]]
    for k in range(walls.shape[0]):
        packed[walls[k, 0] // block, walls[k, 1] // block, counts] += 1.0


@njit(cache=True)
def least_bound(agreement: float, penalty: float, most_hits: float, total_walls: float) -> float:
    """What ``h - p m`` comes to at least, wherever the agreement comes to ``agreement``."""
    if agreement <= 0.0:
        return 0.0
    borne = most_hits * ((most_hits / total_walls) ** 0.25 / math.sqrt(agreement) - 1.0)
    least: float = min(agreement**2 * total_walls, most_hits - penalty * borne)
    return least


def tightest_penalty(agreement: float, most_hits: float, total_walls: float) -> float:
    """The p whose bound leaves least where ``agreement`` is to be reached: that of the chord itself."""
    borne = most_hits * ((most_hits / total_walls) ** 0.25 / math.sqrt(agreement) - 1.0)
    needed = agreement**2 * total_walls
    return (most_hits - needed) / borne if borne > 0.0 else MOST_PENALTY


MOST_PENALTY = 10.0
