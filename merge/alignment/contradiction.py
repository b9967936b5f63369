"""Contradiction of two maps: walls in the free space of the other that no drift explains."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from merge.alignment.patchwise_alignment import align_patch, patches
from merge.alignment.settings import AlignmentSettings
from merge.preparation.prepared_map import PreparedMap, smaller_diagonal
from merge.verification.wall_overlap import classify_walls, tolerance_cells


@dataclass(frozen=True)
class Contradiction:
    """Walls that contradict after every part of the maps is aligned by itself, the mean of both directions.

    - ``violation_ratio``: share of the compared walls that lie in the other map's free space;
    - ``conflict_ratio``: share of them in long connected pieces, which are no objects that only one robot saw;
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
    level: int,
    settings: AlignmentSettings = AlignmentSettings(),
) -> Contradiction:
    """Measure how two maps contradict under ``target_from_source`` (cells), by the tolerance of a ``level``.

    Drift moves parts of a map by more than a tolerance, but each part still fits by itself. Another storey, or another
    room of the same shape, has walls where this one has none. Swapping the maps and inverting the transform gives the
    same.
    """
    scale, coarser = answer.scale, max(1.0, answer.scale)
    tolerance = tolerance_cells(target, source, scale, settings.overlap, level)
    shortest = settings.contradiction.min_piece_tolerances * tolerance_cells(target, source, scale, settings.overlap)
    there = _one_way(target, source, answer, tolerance, shortest / scale, settings)
    here = _one_way(source, target, answer.inverse(), tolerance / scale, shortest, settings)
    compared, violation, conflict = ((scale * there + here) / (2.0 * coarser)).tolist()
    if compared == 0.0:
        return Contradiction(None, None, 0.0)
    return Contradiction(violation / compared, conflict / compared, conflict)


def _one_way(
    below: PreparedMap,
    above: PreparedMap,
    below_from_above: Similarity2,
    tolerance: float,
    shortest: float,
    settings: AlignmentSettings,
) -> NDArray[np.float64]:
    """Count the wall points of ``above`` (3,): compared, in free space of ``below``, and of these in long pieces.

    ``tolerance`` is in cells of ``below``, ``shortest`` the extent of a long piece in cells of ``above``.
    """
    cosine, patchwise = settings.overlap.min_normal_cosine, settings.patchwise
    diagonal = smaller_diagonal(below, above, below_from_above.scale)
    classes = classify_walls(below, above, np.arange(len(above.points)), below_from_above, tolerance, cosine)
    for members in patches(above, patchwise.patch_share * diagonal / below_from_above.scale, patchwise.min_points):
        if not classes[members, 2].any():
            continue
        local = align_patch(below, above, below_from_above, members, diagonal, patchwise, settings.icp.line_weight)
        if local is None:
            continue
        moved = classify_walls(below, above, members, local, tolerance, cosine)
        if moved[:, 2].sum() < classes[members, 2].sum():
            classes[members] = moved
    violating = above.points[classes[:, 2] > 0.0]
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
