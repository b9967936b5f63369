"""Measures that describe a pair of maps, so that it can be compared with those of the thesis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from mapping.grid.occupancy_grid import OccupancyGrid
from reproductions.chen2021.missions import HALL_AREA, MapPair, hole_share

TOUCHING = np.ones((3, 3), dtype=bool)
"""Cells that touch by a corner belong to one piece of wall."""


@dataclass(frozen=True)
class Descriptors:
    """Measures of a pair of maps, measured on their final rasters; of both maps, the first one first.

    - ``of_second``, ``of_first``: common known cells as a share of the map's;
    - ``known``: known area as a share of the hall's;
    - ``holes``: unknown cells that known ones enclose, as a share of all cells inside the outline;
    - ``pieces``: separate pieces of wall;
    - ``thickness``: occupied cells for each of them that touches a free cell by a side.
    """

    trial: str
    seed: int
    of_second: float
    of_first: float
    known: tuple[float, float]
    holes: tuple[float, float]
    pieces: tuple[int, int]
    thickness: tuple[float, float]

    @staticmethod
    def of(pair: MapPair, trial: str, seed: int) -> Descriptors:
        of_second, of_first = pair.overlap
        grids = pair.first.grid, pair.second.grid
        return Descriptors(
            trial,
            seed,
            of_second=of_second,
            of_first=of_first,
            known=(_known(grids[0]), _known(grids[1])),
            holes=(hole_share(grids[0].known), hole_share(grids[1].known)),
            pieces=(_pieces(grids[0]), _pieces(grids[1])),
            thickness=(_thickness(grids[0]), _thickness(grids[1])),
        )


def _known(grid: OccupancyGrid) -> float:
    return float(np.count_nonzero(grid.known) * grid.frame.resolution**2 / HALL_AREA)


def _pieces(grid: OccupancyGrid) -> int:
    return int(ndimage.label(grid.occupied, TOUCHING)[1])


def _thickness(grid: OccupancyGrid) -> float:
    facing = grid.occupied & ndimage.binary_dilation(grid.free)
    return float(grid.occupied.sum() / max(1, int(facing.sum())))
