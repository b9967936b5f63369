"""ICP of one map's wall cells on the other's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.validation import require_valid
from merge.preparation.surface import Indices, centres, label_nearest


@dataclass(frozen=True, eq=False)
class WallCells:
    """The wall cells of a map.

    Centres (N, 2) in cells, and for each cell of the raster and of ``margin`` more on every side the index of the
    nearest of them.
    """

    points: NDArray[np.float64]
    nearest: Indices
    margin: int

    @staticmethod
    def of(grid: OccupancyGrid, margin: int) -> WallCells:
        """Collect the wall cells of a grid; a map without walls has no point."""
        points = centres(grid.occupied)
        if not len(points):
            return WallCells(points, np.zeros((0, 0), np.int32), margin)
        rows, cols = (side + 2 * margin for side in grid.frame.shape)
        nearest = np.empty((rows, cols), np.int32)
        row, col = np.nonzero(grid.occupied)
        label_nearest(nearest, row + margin, col + margin, np.arange(len(points)))
        return WallCells(points, nearest, margin)

    def partners(self, points: NDArray[np.float64], gate: float) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Find the nearest wall cells of points (M, 2), and test if each is within ``gate`` cells."""
        cells = np.floor(points).astype(np.intp)[:, ::-1] + self.margin
        inside = np.all((cells >= 0) & (cells < np.array(self.nearest.shape)), axis=1)
        cells = np.clip(cells, 0, np.array(self.nearest.shape) - 1)
        partners = self.points[self.nearest[cells[:, 0], cells[:, 1]]]
        near = np.hypot(*(partners - points).T) <= gate
        return partners, inside & near


@dataclass(frozen=True)
class IcpSettings:
    """ICP on wall cells.

    - ``gate_cells``: first gate, in cells of the coarser map; Chen's 10 pixels;
    - ``least_gate_cells``: the gate is halved until this, whenever the points have come to rest;
    - ``iterations``: steps at one gate, at most;
    - ``points``: size of the sample of the source's wall cells;
    - ``rest_cells``: points that move by less have come to rest.
    """

    gate_cells: float = 10.0
    least_gate_cells: float = 2.5
    iterations: int = 15
    points: int = 2000
    rest_cells: float = 0.01

    def __post_init__(self) -> None:
        require_valid(self)


def icp(
    target: WallCells,
    source: WallCells,
    start: Similarity2,
    scale: ScaleRange,
    settings: IcpSettings = IcpSettings(),
) -> Similarity2:
    """Align wall cells within the gate, cells to cells, from ``start``; return ``start`` if fewer than three match.

    Source: Besl and McKay 1992 with the gate and closed form of Chen 2021, section 5.6 (here Umeyama 1991).
    """
    if not len(target.points) or len(source.points) < 3:
        return start
    sample = source.points[:: max(1, len(source.points) // settings.points)]
    found, gate = start, settings.gate_cells
    while gate >= settings.least_gate_cells:
        for _ in range(settings.iterations):
            moved = found.apply(sample)
            partners, near = target.partners(moved, gate * max(1.0, found.scale))
            fit = fit_similarity(partners[near], sample[near], scale) if near.sum() >= 3 else None
            if fit is None:
                return found
            found = fit
            if np.abs(found.apply(sample) - moved).max() < settings.rest_cells:
                break
        gate /= 2.0
    return found
