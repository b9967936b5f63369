"""Contradiction of two maps: walls in the free space of the other that no drift explains."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from merge.alignment.settings import AlignmentSettings
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.surface import Surface
from merge.records.bend import Bend
from merge.verification.settings import WallOverlapSettings
from merge.verification.wall_overlap import bent_surfaces, classify_walls, tolerance_cells


@dataclass(frozen=True)
class Contradiction:
    """Walls that contradict after one map is bent onto the other, the mean of both directions.

    - ``violation_ratio``: share of the compared walls that lie in the other map's free space, by the middle tolerance;
    - ``conflict_ratio``: share of them in long connected pieces, by the loosest tolerance: other walls, no objects that
      only one robot saw;
    - ``conflict_cells``: number of wall cells in those pieces, in cells of the coarser map.

    The ratios are None if nothing is compared.
    """

    violation_ratio: float | None
    conflict_ratio: float | None
    conflict_cells: float


def measure_contradiction(
    target: PreparedMap,
    source: PreparedMap,
    answer: Similarity2,
    bend: Bend,
    settings: AlignmentSettings = AlignmentSettings(),
) -> Contradiction:
    """Measure how two maps contradict under ``target_from_source`` (cells) and a bend.

    Drift moves parts of a map by more than a tolerance, but bent by a little, they fit. Another storey, or another room
    of the same shape, has walls where this one has none.
    """
    level = min(settings.contradiction.level, len(settings.overlap.tolerance_shares) - 1)
    compared, violation, _ = _both_ways(target, source, answer, bend, level, settings)
    loosely, _, conflict = _both_ways(target, source, answer, bend, 0, settings)
    return Contradiction(
        violation / compared if compared > 0.0 else None, conflict / loosely if loosely > 0.0 else None, conflict
    )


def _both_ways(
    target: PreparedMap, source: PreparedMap, answer: Similarity2, bend: Bend, level: int, settings: AlignmentSettings
) -> tuple[float, float, float]:
    """Count wall points by a tolerance, the mean of both directions in cells of the coarser map: compared, in free
    space, and of these in long pieces."""
    scale, overlap = answer.scale, settings.overlap
    tolerance = tolerance_cells(target, source, scale, overlap, level)
    shortest = settings.contradiction.min_piece_tolerances * tolerance_cells(target, source, scale, overlap)
    bent, seen, back = bent_surfaces(target, source, answer, bend)
    there = _one_way(target.surface, bent, answer, tolerance, shortest / scale, source.points, overlap)
    here = _one_way(source.surface, seen, back, tolerance / scale, shortest, target.points, overlap)
    compared, violation, conflict = ((scale * there + here) / (2.0 * max(1.0, scale))).tolist()
    return compared, violation, conflict


def _one_way(
    below: Surface,
    above: Surface,
    below_from_above: Similarity2,
    tolerance: float,
    shortest: float,
    points: NDArray[np.float64],
    settings: WallOverlapSettings,
) -> NDArray[np.float64]:
    """Count the wall points of ``above`` (3,): compared, in free space of ``below``, and of these in long pieces.

    ``tolerance`` is in cells of ``below``, ``shortest`` the extent of a long piece in cells of ``above``, whose
    ``points`` (N, 2) are those before a bend.
    """
    classes = classify_walls(
        below, above, np.arange(len(points)), below_from_above, tolerance, settings.min_normal_cosine
    )
    violating = points[classes[:, 2] > 0.0]
    extents = _piece_extents(violating)
    return np.array([classes.sum(), len(violating), np.count_nonzero(extents >= shortest)])


def _piece_extents(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return for each wall point (N,) the diagonal [cells] of its connected piece; a gap of a cell parts none."""
    if not len(points):
        return np.zeros(0)
    cells = np.floor(points - points.min(axis=0)).astype(np.int64) + 1
    columns, rows = cells.T
    raster = np.zeros((rows.max() + 2, columns.max() + 2), np.uint8)
    raster[rows, columns] = 1
    dilated = cv2.dilate(raster, np.ones((3, 3), np.uint8))
    _, labels, boxes, _ = cv2.connectedComponentsWithStats(dilated, connectivity=8)
    sides = boxes[labels[rows, columns], cv2.CC_STAT_WIDTH : cv2.CC_STAT_HEIGHT + 1] - 2
    return np.hypot(sides[:, 0], sides[:, 1])
