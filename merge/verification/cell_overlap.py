"""Overlap of the cells of two maps under a transform."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid


@dataclass(frozen=True)
class CommonCells:
    """Area that both maps know, in cells of the coarser map, divided into agreeing and disagreeing cells."""

    agree: float
    disagree: float
    smaller: float

    @property
    def known(self) -> float:
        return self.agree + self.disagree

    @property
    def acceptance_index(self) -> float | None:
        """Index of Birk and Carpin 2006, equation 4: agree / (agree + disagree); None without common cells."""
        return self.agree / self.known if self.known > 0.0 else None

    @property
    def overlap(self) -> float:
        """Common area as a share of the known area of the map that knows less."""
        return min(1.0, self.known / self.smaller) if self.smaller > 0.0 else 0.0


def compare_cells(target: OccupancyGrid, source: OccupancyGrid, target_from_source: Similarity2) -> CommonCells:
    """Compare the original rasters, each cell with the cell of the other map that holds its centre.

    ``target_from_source`` maps cells to cells (``PreparedMap``). Free on free and occupied on occupied agree, free on
    occupied disagrees. The areas are the mean of both directions, so that swapping the maps and inverting the transform
    gives the same.
    """
    scale = target_from_source.scale
    area, coarser = scale**2, max(1.0, scale) ** 2
    there = np.array(_counts(target, source, target_from_source))
    back = np.array(_counts(source, target, target_from_source.inverse()))
    agree, disagree = (area * there + back) / (2.0 * coarser)
    smaller = min(area * np.count_nonzero(source.known), float(np.count_nonzero(target.known))) / coarser
    return CommonCells(float(agree), float(disagree), float(smaller))


def _counts(below: OccupancyGrid, above: OccupancyGrid, below_from_above: Similarity2) -> tuple[int, int]:
    return _count(below.log_odds, above.log_odds, below_from_above.matrix())


@njit(cache=True)
def _count(
    below: NDArray[np.float32], above: NDArray[np.float32], below_from_above: NDArray[np.float64]
) -> tuple[int, int]:
    agree, disagree = 0, 0
    for row in range(above.shape[0]):
        for col in range(above.shape[1]):
            here = above[row, col]
            if here == 0.0:
                continue
            x, y = col + 0.5, row + 0.5
            there_col = math.floor(below_from_above[0, 0] * x + below_from_above[0, 1] * y + below_from_above[0, 2])
            there_row = math.floor(below_from_above[1, 0] * x + below_from_above[1, 1] * y + below_from_above[1, 2])
            if there_row < 0 or there_col < 0 or there_row >= below.shape[0] or there_col >= below.shape[1]:
                continue
            there = below[there_row, there_col]
            if there != 0.0:
                if (here > 0.0) == (there > 0.0):
                    agree += 1
                else:
                    disagree += 1
    return agree, disagree
