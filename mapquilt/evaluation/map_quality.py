"""How good a merged map is, cell by cell, against the true raster."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import resampled

WALL_TOLERANCE = 0.1
"""How far a wall may lie from where it truly is and still count [m]: two true cells."""


@dataclass(frozen=True)
class MapQuality:
    """``iou_free``: intersection over union of the free cells. ``wall_precision`` and ``wall_recall``: the shares of
    the map's walls that lie within ``WALL_TOLERANCE`` of a true one, and of the true ones that have one of the map's
    as near; ``f1_walls`` their harmonic mean (van Rijsbergen 1979). All 0 to 1; 0 where there is nothing to count."""

    iou_free: float
    wall_precision: float
    wall_recall: float
    f1_walls: float


def map_quality(merged: OccupancyGrid, world_from_merged: Similarity2, truth: OccupancyGrid) -> MapQuality:
    """Compare a map with what its team could truly see: ``truth`` is the true raster, unknown where nobody looked.

    Whatever the map claims elsewhere counts against it, and so does what it lacks.
    """
    frame, true_free, true_walls = _around(truth, merged, world_from_merged)
    seen = resampled(merged, world_from_merged, frame)
    free, walls = seen < 0.0, seen > 0.0
    precision = _near(walls, true_walls, frame.resolution)
    recall = _near(true_walls, walls, frame.resolution)
    return MapQuality(
        iou_free=_ratio(float((free & true_free).sum()), float((free | true_free).sum())),
        wall_precision=precision,
        wall_recall=recall,
        f1_walls=_ratio(2.0 * precision * recall, precision + recall),
    )


def _around(
    truth: OccupancyGrid, merged: OccupancyGrid, world_from_merged: Similarity2
) -> tuple[GridFrame, NDArray[np.bool_], NDArray[np.bool_]]:
    """The true raster's frame, grown by whole cells to hold the map, and its free and wall cells there."""
    rows, cols = merged.frame.shape
    outer = np.array([(0, 0), (0, cols), (rows, 0), (rows, cols)]) - 0.5
    corners = truth.frame.cells_from_metres(world_from_merged.apply(merged.frame.metres_from_cells(outer)))
    low = np.minimum(0, corners.min(axis=0))
    high = np.maximum(truth.frame.shape, corners.max(axis=0) + 1)
    margin = tuple(
        (int(-below), int(above - side)) for below, above, side in zip(low, high, truth.frame.shape, strict=True)
    )
    resolution = truth.frame.resolution
    origin = truth.frame.origin @ SE2(float(low[1]) * resolution, float(low[0]) * resolution, 0.0)
    frame = GridFrame(resolution, origin, (int(high[0] - low[0]), int(high[1] - low[1])))
    return frame, np.pad(truth.free, margin), np.pad(truth.occupied, margin)


def _near(some: NDArray[np.bool_], others: NDArray[np.bool_], resolution: float) -> float:
    """The share of some cells that have one of the others within the tolerance."""
    if not some.any() or not others.any():
        return 0.0
    distance = distance_transform_edt(~others) * resolution
    return float(np.mean(distance[some] <= WALL_TOLERANCE + 1e-9))


def _ratio(above: float, below: float) -> float:
    return above / below if below else 0.0
