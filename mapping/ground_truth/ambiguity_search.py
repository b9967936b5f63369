"""Identifiability of a pair: an exact search for a second placement where the true footprints agree as well.

Repeated rooms, shelves and symmetric halls are truly ambiguous, so a refusal is right.

All rotations and shifts are bounded from above, and a score is counted only where the bound may beat the best
placement so far. A rotation by a quarter turn more is a rotation of the fixed footprint by a quarter turn back, which
only renames its cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.coarse_footprint import (
    COARSE_RESOLUTION,
    CoarseFootprint,
    FootprintRotation,
    RotatedFootprint,
)
from mapping.ground_truth.wall_agreement import HIT, AgreementBound, least_bound, tightest_penalty, wall_agreement_at

NEAR_DISTANCE = 1.0
NEAR_ANGLE_DEG = 10
MAX_SECOND_BEST = 0.9
"""A second placement is over NEAR_DISTANCE [m] or NEAR_ANGLE_DEG away from the true one. The pair is ambiguous if it
reaches this fraction of the true placement's score. These three define the truth and are no settings."""

ROTATION_STEP_DEG = 3
QUARTERS = 4
ROUNDING_HITS = 0.5
"""Bounds are widened by so many hits, for the rounding of transforms in single precision."""

FIRST_GUESS = 0.4
FIRST_BLOCKS = 24
"""Blocks of shifts of each quarter turn that are counted first, with bounds for this score."""

BLOCK = 2
COUNTING_COST = 6.0
"""Counting costs as much as bounding single shifts if blocks times walls are so many times the bounds."""

PATIENCE = 4.0
"""Rotations by which the cost of counting may exceed that of bounding before single shifts are bounded."""


@dataclass(frozen=True)
class Identifiability:
    """``score`` of the true placement and ``second_best`` of the best one elsewhere, both 0 to 1."""

    score: float
    second_best: float

    @property
    def identifiable(self) -> bool:
        """Check if no second placement agrees nearly as well as the true one."""
        return self.second_best < MAX_SECOND_BEST * self.score


def identifiability(
    target: OccupancyGrid, source: OccupancyGrid, coarse: tuple[CoarseFootprint, CoarseFootprint] | None = None
) -> Identifiability:
    """Search all rotations (by 3 degrees) and shifts (by 0.2 m) of the source's true footprint over the target's.

    Both are true rasters in one world frame, unknown where the robot saw nothing; ``coarse`` are their coarse
    footprints, if at hand. The score is ``(hits / (hits + misses))^2 sqrt(hits / walls)``. Hits are walls on walls of
    the other footprint within the tolerance, misses walls deep in its free space (squared, because exact rasters leave
    no excuse for a miss). Distance is that of the middle of the area that both saw. Footprints that share no cell
    score 0.

    Raises ``ValueError`` if the rasters differ in frame.
    """
    if target.frame != source.frame:
        raise ValueError("identifiability: the two footprints must be rasters of one frame")
    fixed, moving = coarse or (CoarseFootprint.of(target), CoarseFootprint.of(source))
    centre = _middle(target, source)
    if centre is None or not len(fixed.walls) or not len(moving.walls):
        return Identifiability(0.0, 0.0)
    search = AmbiguitySearch(fixed, moving, centre, (NEAR_DISTANCE / COARSE_RESOLUTION, NEAR_ANGLE_DEG))
    return Identifiability(search.true_score(), search.second_best())


def _middle(target: OccupancyGrid, source: OccupancyGrid) -> NDArray[np.int64] | None:
    """Return the coarse cell (row, col) in the middle of the common area: whole, so that cells fall onto themselves."""
    common = target.known & source.known
    counts = [np.count_nonzero(common, axis=axis) for axis in (1, 0)]
    total = int(counts[0].sum())
    if not total:
        return None
    fine = target.frame.resolution / COARSE_RESOLUTION
    means = [float(count @ np.arange(count.size)) / total for count in counts]
    return np.floor((np.array(means) + 0.5) * fine).astype(np.int64)


@dataclass(frozen=True, eq=False)
class _FixedFootprint:
    """The fixed footprint, rotated back by some quarters; ``centre`` is the true cell of the centre of rotation."""

    walls: NDArray[np.int64]
    labels: NDArray[np.uint8]
    centre: tuple[int, int]

    def rotated_back(self) -> _FixedFootprint:
        last = self.labels.shape[1] - 1
        walls = np.stack((last - self.walls[:, 1], self.walls[:, 0]), axis=-1)
        centre = (last - self.centre[1], self.centre[0])
        return _FixedFootprint(walls, np.ascontiguousarray(np.rot90(self.labels)), centre)


class AmbiguitySearch:
    """Search the best score of ``moving`` over ``fixed``, both of one world, rotated about their cell ``centre``.

    Placements within ``near`` (cells, degrees) of the true one do not count as a second placement.
    """

    def __init__(
        self, fixed: CoarseFootprint, moving: CoarseFootprint, centre: NDArray[np.int64], near: tuple[float, float]
    ) -> None:
        row, col = (centre - fixed.corner).tolist()
        self._fixed = [_FixedFootprint(fixed.walls - fixed.corner, fixed.labels, (row, col))]
        for _ in range(QUARTERS - 1):
            self._fixed.append(self._fixed[-1].rotated_back())
        self._rotation = FootprintRotation(moving, centre)
        self._near_cells, self._near_deg = near
        self._total_walls = float(len(fixed.walls) + len(moving.walls))
        self._max_hits_on_fixed = min(len(moving.walls), int(np.count_nonzero(fixed.labels == HIT)))
        self._best = 0.0

    def true_score(self) -> float:
        """Return the best score near the true placement: without a rotation, shifted by the near cells at most."""
        fixed, moving = self._fixed[0], self._rotation.rotated(0.0)
        reach = int(self._near_cells)
        return max(
            wall_agreement_at(fixed.walls, fixed.labels, moving.walls, moving.labels, self._total_walls, row, col)
            for i in range(-reach, reach + 1)
            for j in range(-reach, reach + 1)
            if math.hypot(i, j) <= self._near_cells
            for row, col in [(fixed.centre[0] - moving.centre[0] + i, fixed.centre[1] - moving.centre[1] + j)]
        )

    def second_best(self) -> float:
        """Return the best score anywhere else."""
        self._count_promising()
        bound, excess = self._bound(BLOCK, self._best), -PATIENCE
        for degrees in range(0, 360 // QUARTERS, ROTATION_STEP_DEG):
            moving = self._rotation.rotated(math.radians(degrees))
            bounds = bound.over_blocks(moving.walls, moving.labels)
            counted = sum(self._count(bound, one, moving, degrees, quarter) for quarter, one in enumerate(bounds))
            excess += counted * self._total_walls / (COUNTING_COST * sum(one.size for one in bounds)) - 1.0
            if bound.block > 1 and excess > 0.0:
                bound = self._bound(1, self._best)
        return self._best

    def _bound(self, block: int, score: float) -> AgreementBound:
        """Prepare the bounds that are tightest for a score."""
        most = self._max_hits_on_fixed + len(self._fixed[0].walls)
        penalty = tightest_penalty(max(score, 1e-3), most, self._total_walls)
        return AgreementBound([(one.walls, one.labels) for one in self._fixed], block, penalty)

    def _count_promising(self) -> None:
        """Start with the blocks of largest bound, so that the search begins with a good score."""
        bound = self._bound(BLOCK, FIRST_GUESS)
        moving = self._rotation.rotated(0.0)
        for quarter, bounds in enumerate(bound.over_blocks(moving.walls, moving.labels)):
            least = np.partition(bounds, -FIRST_BLOCKS, axis=None)[-FIRST_BLOCKS]
            self._count(bound, np.where(bounds >= least, bounds, -np.float32(np.inf)), moving, 0, quarter, least)

    def _count(
        self,
        bound: AgreementBound,
        bounds: NDArray[np.float32],
        moving: RotatedFootprint,
        degrees: int,
        quarter: int,
        least: float | None = None,
    ) -> int:
        """Count the score in each block that may beat the best; return the number of those blocks."""
        fixed = self._fixed[quarter]
        rotation = (degrees + 90 * quarter) % 360
        near = self._near_cells if min(rotation, 360 - rotation) <= self._near_deg else -1.0
        hits_on_moving = min(len(fixed.walls), int(np.count_nonzero(moving.labels == HIT)))
        max_hits = float(self._max_hits_on_fixed + hits_on_moving)
        shape = (fixed.labels.shape[0] // bound.block + 2, fixed.labels.shape[1] // bound.block + 2)
        true = (fixed.centre[0] - moving.centre[0], fixed.centre[1] - moving.centre[1])
        self._best, counted = _best_above(
            bounds,
            bound.block,
            shape,
            (*true, near),
            (fixed.walls, fixed.labels, moving.walls, moving.labels, self._total_walls),
            (bound.penalty, max_hits, ROUNDING_HITS if least is None else np.inf),
            self._best,
        )
        return int(counted)


@njit(cache=True)
def _best_above(
    bounds: NDArray[np.float32],
    block: int,
    blocks: tuple[int, int],
    near: tuple[int, int, float],
    footprints: tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.int64], NDArray[np.uint8], float],
    limits: tuple[float, float, float],
    best: float,
) -> tuple[float, int]:
    """Return the best score of all shifts in blocks whose bound may beat ``best``, and the number of those blocks."""
    fixed_walls, fixed_labels, moving_walls, moving_labels, total_walls = footprints
    penalty, max_hits, rounding = limits
    least = least_bound(best, penalty, max_hits, total_walls) - rounding
    counted = 0
    for i in range(bounds.shape[0]):
        for j in range(bounds.shape[1]):
            if bounds[i, j] < least or bounds[i, j] == -np.inf:
                continue
            counted += 1
            top = ((i if i < blocks[0] else i - bounds.shape[0]) - 1) * block
            left = ((j if j < blocks[1] else j - bounds.shape[1]) - 1) * block
            for row in range(top, top + block):
                for col in range(left, left + block):
                    if math.hypot(row - near[0], col - near[1]) <= near[2]:
                        continue
                    score = wall_agreement_at(
                        fixed_walls, fixed_labels, moving_walls, moving_labels, total_walls, row, col
                    )
                    if score > best:
                        best = score
                        least = least_bound(best, penalty, max_hits, total_walls) - rounding
    return best, counted
