"""Truth of a pair whose source is bent."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity_fit import fit_similarity
from mapping.grid.occupancy_grid import OccupancyGrid
from mapquilt.benchmark.disturbance.kinds import DisturbedMap
from mapquilt.evaluation.evaluated_pair import GroundTruth


def refitted_truth(truth: GroundTruth, target: OccupancyGrid, done: DisturbedMap) -> GroundTruth:
    """Return the truth of a pair, in metres as its maps state them, after the cells of its source moved.

    The transform becomes the one of the same scale that is nearest, by least squares, to all cells that both maps know,
    and the residual grows by what it leaves. Where cells stay, the truth does.
    """
    target_from_source = truth.target_from_source
    if target_from_source is None or done.moved is None:
        return truth
    frame, cells = done.before.frame, np.argwhere(done.before.known)
    on_target = target_from_source.apply(frame.metres_from_cells(cells))
    common = _known_at(target, on_target)
    cells, on_target = cells[common], on_target[common]
    after = frame.metres_from_cells(cells + done.moved[cells[:, 0], cells[:, 1]][:, ::-1])
    fitted = fit_similarity(on_target, after, ScaleRange(target_from_source.scale, target_from_source.scale))
    if fitted is None:
        return replace(truth, residual_m=None)
    squares = ((fitted.apply(after) - on_target) ** 2).sum(axis=1)
    left = truth.target_scale * math.sqrt(float(squares.mean()))
    residual = None if truth.residual_m is None else math.hypot(truth.residual_m, left)
    return replace(truth, target_from_source=fitted, residual_m=residual)


def _known_at(grid: OccupancyGrid, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark the points (N, 2) [stated metres] that lie on known cells."""
    cells = grid.frame.cells_from_metres(points)
    inside = grid.frame.contains(cells)
    inside[inside] = grid.known[cells[inside, 0], cells[inside, 1]]
    return inside
