"""ICP of one map's wall cells on the other's."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.verification.cell_overlap import centres


@dataclass(frozen=True, eq=False)
class WallCells:
    """The wall cells of a map, centres (N, 2) in cells, and for each cell of the raster and of ``margin`` more on every
    side the index of the nearest of them."""

    points: NDArray[np.float64]
    nearest: NDArray[np.intp]
    margin: int

    @staticmethod
    def of(grid: OccupancyGrid, margin: int) -> WallCells:
        """Of a grid; a map without walls has no point and no nearest."""
        points = centres(grid.occupied)
        if not len(points):
            return WallCells(points, np.zeros((0, 0), np.intp), margin)
        elsewhere = np.pad(np.where(grid.occupied, 0, 1).astype(np.uint8), margin, constant_values=1)
        _, labels = cv2.distanceTransformWithLabels(
            elsewhere, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
        )
        index = np.zeros(int(labels.max()) + 1, np.intp)
        index[labels[elsewhere == 0]] = np.arange(len(points))
        return WallCells(points, index[labels], margin)

    def partners(self, points: NDArray[np.float64], gate: float) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """The nearest wall cells of points (M, 2), and whether each lies within ``gate`` cells."""
        cells = np.floor(points).astype(np.intp)[:, ::-1] + self.margin
        inside = np.all((cells >= 0) & (cells < np.array(self.nearest.shape)), axis=1)
        cells = np.clip(cells, 0, np.array(self.nearest.shape) - 1)
        partners = self.points[self.nearest[cells[:, 0], cells[:, 1]]]
        near = np.hypot(*(partners - points).T) <= gate
        return partners, inside & near


@dataclass(frozen=True)
class IcpSettings:
    """``gate_cells`` of the coarser map is Chen's 10 pixels; it closes to ``least_gate_cells`` by halves, once the
    steps at one gate have come to rest. ``points`` is a sample of the source's wall cells."""

    gate_cells: float = 10.0
    least_gate_cells: float = 2.5
    iterations: int = 15
    points: int = 2000
    rest_cells: float = 0.01

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise ValueError(f"IcpSettings: {name} is {value}, must be positive")


def icp(
    target: WallCells,
    source: WallCells,
    start: Similarity2,
    scale: ScaleRange,
    settings: IcpSettings = IcpSettings(),
) -> Similarity2:
    """The similarity, cells to cells, that wall cells within the gate settle at, from ``start``; ``start`` itself where
    fewer than three have a partner.

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
