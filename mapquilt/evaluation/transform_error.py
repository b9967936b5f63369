"""How far an answer is from the truth: one definition for score, benchmark, studies and reports."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import wrap_angle
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid


@dataclass(frozen=True)
class Criterion:
    """What counts as right: rotation [degrees], scale [percent] and mean displacement, either as a share of the
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
FOUND = Criterion(rotation_deg=7.0, scale_percent=8.0, displacement_of_diagonal=0.05)
"""The right place, however inexactly told."""

THESIS = Criterion(rotation_deg=5.0, scale_percent=5.0, displacement_cells=10.0)
"""Chen 2021: within 10 px, 5 degrees and 5 %."""


@dataclass(frozen=True)
class TransformError:
    """Rotation [degrees], scale [percent], and the mean displacement of the cells that both maps know under the
    truth: in metres of the world, in cells of the target, and as a share of the diagonal of the target's known cells.
    The displacements are None where the maps share no cell; no answer is right then."""

    rotation_deg: float
    scale_percent: float
    displacement_m: float | None
    displacement_cells: float | None
    displacement_of_diagonal: float | None


def transform_error(
    target: OccupancyGrid,
    source: OccupancyGrid,
    truth: Similarity2,
    answer: Similarity2,
    target_scale: float = 1.0,
) -> TransformError:
    """Error of ``answer`` against ``truth``, both target_from_source.

    ``target_scale`` is true metres per metre that the target states.
    """
    rotation = abs(math.degrees(wrap_angle(answer.yaw - truth.yaw)))
    scale = 100.0 * abs(answer.scale / truth.scale - 1.0)
    points = source.frame.metres_from_cells(np.argwhere(source.known))
    true_points = truth.apply(points)
    cells = target.frame.cells_from_metres(true_points)
    inside = target.frame.contains(cells)
    inside[inside] = target.known[cells[inside, 0], cells[inside, 1]]
    if not inside.any():
        return TransformError(rotation, scale, None, None, None)
    moved = float(np.hypot(*(answer.apply(points[inside]) - true_points[inside]).T).mean())
    return TransformError(
        rotation,
        scale,
        moved * target_scale,
        moved / target.frame.resolution,
        moved / target.known_diagonal,
    )


def normalised_error(truth: Similarity2, answer: Similarity2, covariance: NDArray[np.float64]) -> float:
    """Squared error of x, y, yaw and scale over their covariance (4, 4), as it came with the answer.

    Where the covariance is true its mean over many answers is 4, 3 where the scale is known: the normalised estimation
    error squared of Bar-Shalom, Li and Kirubarajan 2001, section 5.4.
    """
    yaw = wrap_angle(answer.yaw - truth.yaw)
    error = np.array([answer.x - truth.x, answer.y - truth.y, yaw, answer.scale - truth.scale])
    free = np.diag(covariance) > 0.0
    sigma = np.sqrt(np.diag(covariance)[free])  # taken out first: metres and radians may be of very different size
    correlation = covariance[np.ix_(free, free)] / np.outer(sigma, sigma)
    weighed = error[free] / sigma
    return float(weighed @ np.linalg.solve(correlation, weighed))
