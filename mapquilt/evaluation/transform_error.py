"""Errors of a transform against the truth, and the criteria of a right answer."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import wrap_angle
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid


@dataclass(frozen=True)
class Criterion:
    """Bounds of a right answer: rotation [degrees], scale [percent] and mean displacement, either as a share of the
    diagonal of the target's known cells or in target cells."""

    rotation_deg: float
    scale_percent: float
    displacement_of_diagonal: float = math.inf
    displacement_cells: float = math.inf

    def holds(self, error: TransformError) -> bool:
        return (
            error.displacement_cells is not None
            and error.displacement_of_diagonal is not None
            and error.rotation_deg <= self.rotation_deg
            and error.scale_percent <= self.scale_percent
            and error.displacement_of_diagonal <= self.displacement_of_diagonal
            and error.displacement_cells <= self.displacement_cells
        )


RIGHT = Criterion(rotation_deg=2.0, scale_percent=3.0, displacement_of_diagonal=0.015)
"""The criterion of mapquilt: walls of 0.1 m in a map of 20 m then still touch. The merger's confidence uses the same
tolerance of rotation and scale (``merge/records/pair_answer.py``); a test compares the two."""

RIGHT_PLACE = Criterion(rotation_deg=7.0, scale_percent=8.0, displacement_of_diagonal=0.05)
"""The right place, however imprecise."""

THESIS = Criterion(rotation_deg=5.0, scale_percent=5.0, displacement_cells=10.0)
"""Chen 2021: within 10 px, 5 degrees and 5 %."""


@dataclass(frozen=True)
class TransformError:
    """Errors of rotation [degrees] and scale [percent], and the mean displacement of cells: in metres of the world, in
    cells of the target, and as a share of the diagonal of the target's known cells. The displacements are None where
    the maps share no cell; no answer is right then."""

    rotation_deg: float
    scale_percent: float
    displacement_m: float | None
    displacement_cells: float | None
    displacement_of_diagonal: float | None


def mean_displacement(points: NDArray[np.float64], truth: Similarity2, answer: Similarity2) -> float:
    """Average the distance between the images of points (N, 2) under two transforms, in metres of their target."""
    return float(np.hypot(*(answer.apply(points) - truth.apply(points)).T).mean())


def transform_error(
    target: OccupancyGrid,
    source: OccupancyGrid,
    truth: Similarity2,
    answer: Similarity2,
    target_scale: float = 1.0,
    cells: Literal["common", "source"] = "common",
) -> TransformError:
    """Compare ``answer`` with ``truth``, both target_from_source.

    ``target_scale`` is true metres per metre that the target states. The displacement is averaged over the source's
    known cells that the target knows as well under the truth (``common``), or over all that the source knows.
    """
    rotation = abs(math.degrees(wrap_angle(answer.yaw - truth.yaw)))
    scale = 100.0 * abs(answer.scale / truth.scale - 1.0)
    points = source.frame.metres_from_cells(np.argwhere(source.known))
    if cells == "common":
        indices = target.frame.cells_from_metres(truth.apply(points))
        inside = target.frame.contains(indices)
        inside[inside] = target.known[indices[inside, 0], indices[inside, 1]]
        points = points[inside]
    if not len(points):
        return TransformError(rotation, scale, None, None, None)
    moved = mean_displacement(points, truth, answer)
    return TransformError(
        rotation_deg=rotation,
        scale_percent=scale,
        displacement_m=moved * target_scale,
        displacement_cells=moved / target.frame.resolution,
        displacement_of_diagonal=moved / target.known_diagonal,
    )


def normalised_error(truth: Similarity2, answer: Similarity2, covariance: NDArray[np.float64]) -> float:
    """Weigh the squared error of x, y, yaw and scale by their covariance (4, 4), as it came with the answer.

    A consistent covariance gives a mean of 4 over many answers, 3 where the scale is known: the normalised estimation
    error squared of Bar-Shalom, Li and Kirubarajan 2001, section 5.4.
    """
    yaw = wrap_angle(answer.yaw - truth.yaw)
    error = np.array([answer.x - truth.x, answer.y - truth.y, yaw, answer.scale - truth.scale])
    free = np.diag(covariance) > 0.0
    sigma = np.sqrt(np.diag(covariance)[free])  # taken out first: metres and radians may be of very different size
    correlation = covariance[np.ix_(free, free)] / np.outer(sigma, sigma)
    weighed = error[free] / sigma
    return float(weighed @ np.linalg.solve(correlation, weighed))
