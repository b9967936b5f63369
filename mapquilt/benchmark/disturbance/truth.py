"""Truth of a pair whose source is disturbed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from mapping.grid.occupancy_grid import OccupancyGrid
from mapquilt.benchmark.disturbance.kinds import DisturbedMap
from mapquilt.evaluation.evaluated_pair import GroundTruth


def disturbed_truth(truth: GroundTruth, target: OccupancyGrid, done: DisturbedMap) -> GroundTruth:
    """Return the truth of a pair, in metres as its maps state them, after its source was disturbed.

    Where cells move, the transform becomes the one of the same scale that is nearest, by least squares, to all cells
    that both maps know, and the residual grows by what it leaves. Where cells are lost, the overlap changes; nothing in
    common leaves a pair that must be refused.
    """
    if truth.target_from_source is None:
        return truth
    if done.moved is not None:
        return _refitted(truth, truth.target_from_source, target, done, done.moved)
    return _with_less_overlap(truth, truth.target_from_source, target, done)


def _refitted(
    truth: GroundTruth,
    target_from_source: Similarity2,
    target: OccupancyGrid,
    done: DisturbedMap,
    moved: NDArray[np.float32],
) -> GroundTruth:
    frame, cells = done.before.frame, np.argwhere(done.before.known)
    on_target = target_from_source.apply(frame.metres_from_cells(cells))
    common = known_at(target, on_target)
    cells, on_target = cells[common], on_target[common]
    after = frame.metres_from_cells(cells + moved[cells[:, 0], cells[:, 1]][:, ::-1])
    fitted = fit_similarity(on_target, after, ScaleRange(target_from_source.scale, target_from_source.scale))
    if fitted is None:
        return replace(truth, residual_m=None)
    squares = ((fitted.apply(after) - on_target) ** 2).sum(axis=1)
    left = truth.target_scale * math.sqrt(float(squares.mean()))
    residual = None if truth.residual_m is None else math.hypot(truth.residual_m, left)
    return replace(truth, target_from_source=fitted, residual_m=residual)


def _with_less_overlap(
    truth: GroundTruth, target_from_source: Similarity2, target: OccupancyGrid, done: DisturbedMap
) -> GroundTruth:
    """Scale the overlap of the true footprints as that of the known cells changes."""
    frame, cells = done.before.frame, np.argwhere(done.before.known)
    kept = done.grid.known[cells[:, 0], cells[:, 1]]
    common = known_at(target, target_from_source.apply(frame.metres_from_cells(cells)))
    if not (kept & common).any():
        return replace(truth, target_from_source=None, overlap=0.0, residual_m=None)
    if truth.overlap is None:
        return truth
    source_cell = target_from_source.scale * frame.resolution / target.frame.resolution
    area = len(cells) * source_cell**2 / int(np.count_nonzero(target.known))
    smaller = min(1.0, area * float(kept.mean())) / min(1.0, area)
    remaining = float(np.count_nonzero(kept & common)) / float(np.count_nonzero(common))
    return replace(truth, overlap=min(1.0, truth.overlap * remaining / smaller))


def known_at(grid: OccupancyGrid, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark the points (N, 2) [stated metres] that lie on known cells."""
    cells = grid.frame.cells_from_metres(points)
    inside = grid.frame.contains(cells)
    inside[inside] = grid.known[cells[inside, 0], cells[inside, 1]]
    return inside
