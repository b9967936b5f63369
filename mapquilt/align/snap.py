"""Task that aligns a map near the place where a hand has put it."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.validation import require_valid
from merge.pair.pipeline import GuidedTask
from merge.pair.task import PairTask
from merge.records.prior import SIGMA, Expected, Extent
from merge.settings import MergeSettings


@dataclass(frozen=True)
class SnapSettings:
    """Uncertainty of a hand.

    - ``sigma`` [m]: standard deviation of the shift of a map's middle, the default of ``--prior``; starts reach two of
      them, 2 m. The yaw has that of all priors, 10 degrees;
    - ``sigma_cells`` [cells of the target]: the same for a target without a resolution: 1 m of cells of 0.05 m;
    - ``growth``: factor by which the scale may be off, if it is not known; an eye sees more than 10 %.
    """

    sigma: float = SIGMA
    sigma_cells: float = 20.0
    growth: float = 1.1

    def __post_init__(self) -> None:
        require_valid(self)


@dataclass(frozen=True, eq=False)
class Snap:
    """A pair to match near a pose, and the transform from the moved map's middle to its own frame."""

    task: GuidedTask
    source_from_middle: Similarity2

    def target_from_source(self, found: Similarity2) -> Similarity2:
        """Convert the transform of the task's answer to one of the moved map's own frame."""
        return found @ self.source_from_middle.inverse()


def snap_near(
    pair: PairTask,
    target_from_source: Similarity2,
    wall_points: NDArray[np.float64],
    settings: MergeSettings,
    uncertainty: SnapSettings = SnapSettings(),
) -> Snap:
    """Make the task that matches the pair near a pose, by the starts and bounds that a prior of the merger has.

    A hand turns a map about its middle, so the source's frame is shifted there: its ``wall_points`` (N, 2), in stated
    metres, have their mean in the origin. Cells stay what they are.
    """
    x, y = wall_points.mean(axis=0).tolist() if len(wall_points) else (0.0, 0.0)
    pose, grid = target_from_source @ Similarity2(x, y), pair.grids[1]
    frame = dataclasses.replace(grid.frame, origin=SE2(-x, -y) @ grid.frame.origin)
    arm = float(np.hypot(*(wall_points - (x, y)).T).max()) if len(wall_points) else 0.0
    expected = Expected(
        pose,
        uncertainty.sigma if pair.units[0] == "m" else uncertainty.sigma_cells,
        settings.prior,
        scale=_scales_near(pose.scale, pair.scale, uncertainty.growth),
        extent=Extent(2.0 * arm, arm),
    )
    moved = dataclasses.replace(pair, grids=(pair.grids[0], OccupancyGrid(frame, grid.log_odds)))
    return Snap(GuidedTask(moved, expected, (pose,)), Similarity2(x, y))


def _scales_near(scale: float, within: ScaleRange, growth: float) -> ScaleRange:
    """Return the part of a range that is within the growth of a scale, or the nearest end of the range."""
    low, high = (within.clip(math.exp(math.log(scale) + step)) for step in (-math.log(growth), math.log(growth)))
    return ScaleRange(low, high)
