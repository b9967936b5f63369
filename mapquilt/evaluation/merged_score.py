"""The merged map of a group against the true raster."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import resampled
from mapping.ground_truth.truth import fit_rigid
from mapping.map_set import MapSet
from mapquilt.runs.truth_file import RunTruth


@dataclass(frozen=True)
class MergedScore:
    """How true a merged map is where its robots could look, on the true cells: ``iou_free`` is the intersection over
    union of the free cells, ``f1_walls`` the harmonic mean of ``precision_walls`` (merged walls within one cell of a
    true one) and ``recall_walls`` (true walls within one cell of a merged one). ``pose_error_m`` is the median over its
    maps of the mean displacement of their known cells [m]. None where there is nothing to compare."""

    reference: str
    maps: tuple[str, ...]
    iou_free: float | None
    f1_walls: float | None
    precision_walls: float | None
    recall_walls: float | None
    pose_error_m: float | None


def merged_score(
    maps: MapSet,
    truth: RunTruth,
    reference_from_map: Mapping[str, Similarity2],
    reference: str,
    merged: OccupancyGrid,
    world: OccupancyGrid,
    footprints: Mapping[str, OccupancyGrid],
) -> MergedScore:
    """Compare a merged map with the ``world``'s true raster, where a footprint of one of its maps is known."""
    world_from_reference = placed_in_world(maps, truth, reference_from_map)
    names = tuple(name for name in maps.names if name in reference_from_map)
    seen = np.any([footprints[name].known for name in names], axis=0)
    log_odds = resampled(merged, world_from_reference, world.frame)
    coarse = world_from_reference.scale * merged.frame.resolution / world.frame.resolution
    reach = max(1, math.floor(coarse + 0.5))
    return MergedScore(
        reference,
        names,
        _share((log_odds < 0.0) & world.free & seen, ((log_odds < 0.0) | world.free) & seen),
        *_walls(log_odds > 0.0, world.occupied, seen, reach),
        _pose_error(maps, truth, reference_from_map, world_from_reference),
    )


def placed_in_world(maps: MapSet, truth: RunTruth, reference_from_map: Mapping[str, Similarity2]) -> Similarity2:
    """world_from_reference, rigid but for the reference frame's true scale, that lays all maps of a group best where
    they truly lie: the group's place in the world is nobody's error."""
    scales, merged, true = [], [], []
    for name, place in reference_from_map.items():
        world_from_map = truth.robot(name).truth.world_from_map
        scales.append(math.log(world_from_map.scale / place.scale))
        corners = _points(maps, name)
        merged.append(place.apply(corners))
        true.append(world_from_map.apply(corners))
    scale = math.exp(float(np.median(scales)))
    rigid = fit_rigid(scale * np.concatenate(merged), np.concatenate(true))
    return Similarity2.from_se2(rigid) @ Similarity2(scale=scale)


def _points(maps: MapSet, name: str) -> NDArray[np.float64]:
    grid = maps.grids[maps.names.index(name)]
    known = np.argwhere(grid.known)
    return grid.frame.metres_from_cells(known[:: max(1, len(known) // 2000)])


def _pose_error(
    maps: MapSet, truth: RunTruth, reference_from_map: Mapping[str, Similarity2], world_from_reference: Similarity2
) -> float:
    errors = []
    for name, place in reference_from_map.items():
        points = _points(maps, name)
        off = (world_from_reference @ place).apply(points) - truth.robot(name).truth.world_from_map.apply(points)
        errors.append(float(np.hypot(*off.T).mean()))
    return float(np.median(errors))


def _share(part: NDArray[np.bool_], whole: NDArray[np.bool_]) -> float | None:
    number = int(np.count_nonzero(whole))
    return int(np.count_nonzero(part)) / number if number else None


def _walls(
    found: NDArray[np.bool_], true: NDArray[np.bool_], seen: NDArray[np.bool_], reach: int
) -> tuple[float | None, float | None, float | None]:
    """F1, precision and recall of walls within ``reach`` cells."""
    around = np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)

    def near(walls: NDArray[np.bool_]) -> NDArray[np.bool_]:
        return cv2.dilate(walls.astype(np.uint8), around) > 0

    precision = _share(found & near(true), found)
    recall = _share(true & seen & near(found), true & seen)
    if precision is None or recall is None or precision + recall == 0.0:
        return None, precision, recall
    return 2.0 * precision * recall / (precision + recall), precision, recall
