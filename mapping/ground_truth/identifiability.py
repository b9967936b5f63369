"""Whether a pair has one right answer at all: is there a second place where the true footprints agree as well?

Repeated rooms, shelves and symmetric halls make honest ambiguity: there a refusal is right.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.ambiguity_search import AmbiguitySearch
from mapping.ground_truth.footprint_layers import COARSE_RESOLUTION, FootprintLayers

NEAR_DISTANCE = 1.0
NEAR_ANGLE_DEG = 10
NEARLY_AS_WELL = 0.9
"""A second placement counts if it is over NEAR_DISTANCE [m] or NEAR_ANGLE_DEG away and reaches this share of the true
placement's agreement."""


@dataclass(frozen=True)
class Identifiability:
    """``agreement`` of the true placement and ``rival`` of the best one elsewhere, both 0 to 1."""

    agreement: float
    rival: float

    @property
    def identifiable(self) -> bool:
        """Whether no second placement agrees nearly as well as the true one."""
        return self.rival < NEARLY_AS_WELL * self.agreement


def identifiability(
    target: OccupancyGrid, source: OccupancyGrid, layers: tuple[FootprintLayers, FootprintLayers] | None = None
) -> Identifiability:
    """Search all turns, in steps of 3 degrees, and shifts, in steps of 0.2 m, of the source's true footprint over the
    target's.

    Both are true rasters in one world frame, unknown where the robot saw nothing; ``layers`` are those of the two
    where they are known already. Agreement is that of ``(hits / (hits + misses))^2 sqrt(hits / walls)``, hits being
    walls on walls of the other footprint within the tolerance, misses walls deep in its free space (squared, because
    exact rasters leave no excuse for a miss); distance is that of the middle of the area that both saw.

    Footprints that share no cell agree by 0. Raises ``ValueError`` where the rasters differ in frame.
    """
    if target.frame != source.frame:
        raise ValueError("identifiability: the two footprints must be rasters of one frame")
    fixed, moving = layers or (FootprintLayers.of(target), FootprintLayers.of(source))
    centre = _middle(target, source)
    if centre is None or not len(fixed.walls) or not len(moving.walls):
        return Identifiability(0.0, 0.0)
    search = AmbiguitySearch(fixed, moving, centre, (NEAR_DISTANCE / COARSE_RESOLUTION, NEAR_ANGLE_DEG))
    return Identifiability(search.agreement(), search.rival())


def _middle(target: OccupancyGrid, source: OccupancyGrid) -> NDArray[np.int64] | None:
    """The coarse cell (row, col) amid what both saw: a whole one, so that without a turn cells fall onto themselves."""
    common = target.known & source.known
    counts = [np.count_nonzero(common, axis=axis) for axis in (1, 0)]
    total = int(counts[0].sum())
    if not total:
        return None
    fine = target.frame.resolution / COARSE_RESOLUTION
    means = [float(count @ np.arange(count.size)) / total for count in counts]
    return np.floor((np.array(means) + 0.5) * fine).astype(np.int64)
