"""Quality of a merged map, cell by cell, against the true raster."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import resampled
from mapping.ground_truth.truth import fit_rigid
from mapping.map_set import MapSet
from mapquilt.evaluation.transform_error import mean_displacement

WALL_TOLERANCE = 0.1
"""Largest distance of a wall cell to a true one [m]: two true cells, so that a wall drawn one cell thicker counts."""

MOST_POINTS = 2000
"""Known cells of a map that fix its place; more change the fit by less than a millimetre."""


@dataclass(frozen=True)
class MapQuality:
    """``iou_free``: intersection over union of the free cells. ``precision_walls`` and ``recall_walls``: shares of the
    map's walls that lie within ``WALL_TOLERANCE`` of a true one, and of the true walls that lie as near to one of the
    map's; ``f1_walls``: their harmonic mean (van Rijsbergen 1979). All 0 to 1; 0 if there is nothing to count."""

    iou_free: float
    f1_walls: float
    precision_walls: float
    recall_walls: float


def map_quality(merged: OccupancyGrid, world_from_merged: Similarity2, truth: OccupancyGrid) -> MapQuality:
    """Compare a map with the true raster, which is unknown where no robot looked (``observed_part``).

    Two decisions define the measure. Cells that the map claims outside the observed part count against it: they are
    what a wrong merge invents, and a measure inside the observed part alone would not see them. The tolerance of a
    wall is a distance in the world and not one cell of the map: a coarser map would otherwise score better.
    """
    frame, true_free, true_walls = _around(truth, merged, world_from_merged)
    cells = resampled(merged, world_from_merged, frame)
    free, walls = cells < 0.0, cells > 0.0
    precision = _share_near(walls, true_walls, frame.resolution)
    recall = _share_near(true_walls, walls, frame.resolution)
    return MapQuality(
        iou_free=_ratio(float((free & true_free).sum()), float((free | true_free).sum())),
        f1_walls=_ratio(2.0 * precision * recall, precision + recall),
        precision_walls=precision,
        recall_walls=recall,
    )


def observed_part(world: OccupancyGrid, footprints: Sequence[OccupancyGrid]) -> OccupancyGrid:
    """Keep of the true raster the cells that any of the footprints knows, all in one frame."""
    known = np.any([footprint.known for footprint in footprints], axis=0)
    return OccupancyGrid(world.frame, np.where(known, world.log_odds, np.float32(0.0)))


def align_to_world(
    maps: MapSet, world_from_map: Mapping[str, Similarity2], reference_from_map: Mapping[str, Similarity2]
) -> Similarity2:
    """Find the world_from_reference that best aligns all joined maps with their true transforms.

    A merged map may lie anywhere in the world: its frame is a gauge, so quality is measured after the best alignment,
    as trajectories are (Zhang and Scaramuzza 2018). Placing it by the truth of the reference map alone would turn the
    whole map by the drift of one robot. The scale is the median over maps, the rest a least-squares fit.
    """
    scales, merged, true = [], [], []
    for name, place in reference_from_map.items():
        points = _known_points(maps, name)
        scales.append(math.log(world_from_map[name].scale / place.scale))
        merged.append(place.apply(points))
        true.append(world_from_map[name].apply(points))
    scale = math.exp(float(np.median(scales)))
    rigid = fit_rigid(scale * np.concatenate(merged), np.concatenate(true))
    return Similarity2.from_se2(rigid) @ Similarity2(scale=scale)


def median_pose_error(
    maps: MapSet,
    world_from_map: Mapping[str, Similarity2],
    reference_from_map: Mapping[str, Similarity2],
    world_from_reference: Similarity2,
) -> float:
    """Take the median over joined maps of the mean displacement of their known cells [m]."""
    errors = [
        mean_displacement(_known_points(maps, name), world_from_map[name], world_from_reference @ place)
        for name, place in reference_from_map.items()
    ]
    return float(np.median(errors))


def _known_points(maps: MapSet, name: str) -> NDArray[np.float64]:
    grid = maps.grids[maps.names.index(name)]
    known = np.argwhere(grid.known)
    return grid.frame.metres_from_cells(known[:: max(1, len(known) // MOST_POINTS)])


def _around(
    truth: OccupancyGrid, merged: OccupancyGrid, world_from_merged: Similarity2
) -> tuple[GridFrame, NDArray[np.bool_], NDArray[np.bool_]]:
    """Grow the true raster's frame by whole cells to hold the map; return it with its free and wall cells."""
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


def _share_near(cells: NDArray[np.bool_], others: NDArray[np.bool_], resolution: float) -> float:
    """Return the share of cells that lie within the tolerance of one of the others."""
    if not cells.any() or not others.any():
        return 0.0
    distance = distance_transform_edt(~others) * resolution
    return float(np.mean(distance[cells] <= WALL_TOLERANCE + 1e-9))


def _ratio(above: float, below: float) -> float:
    return above / below if below else 0.0
