"""The best placement of one footprint over another away from the true one: an exact search that counts little.

All turns and shifts are bounded from above; only where the bound may beat the best placement so far is agreement
counted. A turn by a quarter more is had by turning the fixed footprint back by a quarter, which only renames its cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.ground_truth.agreement_bound import AgreementBound, least_bound, tightest_penalty
from mapping.ground_truth.footprint_agreement import agreement_at
from mapping.ground_truth.footprint_layers import NEAR, FootprintLayers
from mapping.ground_truth.rotated_footprint import FootprintRotation, RotatedFootprint

ROTATION_STEP_DEG = 3
QUARTERS = 4
SLACK = 0.5
"""Hits by which bounds are widened, for the rounding of transforms in single precision."""

FIRST_GUESS = 0.4
FIRST_BLOCKS = 24
"""Blocks of shifts of each quarter turn that are counted first, whatever their bound."""

BLOCK = 2
COSTLY = 6.0
"""Counting costs as much as bounding single shifts where blocks times walls come to so many times the bounds."""

PATIENCE = 4.0
"""By how many turns' worth of that counting may run ahead before single shifts are bounded."""


@dataclass(frozen=True, eq=False)
class _Facing:
    """The fixed footprint turned back by some quarters, and where the cell truly lies that the moving one turns
    about."""

    walls: NDArray[np.int64]
    says: NDArray[np.uint8]
    true: tuple[int, int]

    def turned_back(self) -> _Facing:
        last = self.says.shape[1] - 1
        walls = np.stack((last - self.walls[:, 1], self.walls[:, 0]), axis=-1)
        return _Facing(walls, np.ascontiguousarray(np.rot90(self.says)), (last - self.true[1], self.true[0]))


class AmbiguitySearch:
    """Looks for the best agreement of ``moving`` over ``fixed``, both of one world, about their cell ``centre``;
    placements within ``near_cells`` and ``near_deg`` of the true one do not count."""

    def __init__(
        self, fixed: FootprintLayers, moving: FootprintLayers, centre: NDArray[np.int64], near: tuple[float, float]
    ) -> None:
        row, col = (centre - fixed.corner).tolist()
        self._facings = [_Facing(fixed.walls - fixed.corner, fixed.says, (row, col))]
        for _ in range(QUARTERS - 1):
            self._facings.append(self._facings[-1].turned_back())
        self._turning = FootprintRotation(moving, centre)
        self._near_cells, self._near_deg = near
        self._total_walls = float(len(fixed.walls) + len(moving.walls))
        self._most_there = min(len(moving.walls), int(np.count_nonzero(fixed.says == NEAR)))
        self._best = 0.0

    def agreement(self) -> float:
        """The best agreement of the true placement: without a turn, shifted no farther than the near cells."""
        facing, moving = self._facings[0], self._turning.turned(0.0)
        reach = int(self._near_cells)
        return max(
            agreement_at(facing.walls, facing.says, moving.walls, moving.says, self._total_walls, row, col)
            for i in range(-reach, reach + 1)
            for j in range(-reach, reach + 1)
            if math.hypot(i, j) <= self._near_cells
            for row, col in [(facing.true[0] - moving.centre[0] + i, facing.true[1] - moving.centre[1] + j)]
        )

    def rival(self) -> float:
        """The best agreement anywhere else."""
        self._count_promising()
        bound, spent = self._bound(BLOCK, self._best), -PATIENCE
        for degrees in range(0, 360 // QUARTERS, ROTATION_STEP_DEG):
            moving = self._turning.turned(math.radians(degrees))
            bounds = bound.over_blocks(moving)
            counted = sum(self._count(bound, one, moving, degrees, quarter) for quarter, one in enumerate(bounds))
            spent += counted * self._total_walls / (COSTLY * sum(one.size for one in bounds)) - 1.0
            if bound.block > 1 and spent > 0.0:
                bound = self._bound(1, self._best)
        return self._best

    def _bound(self, block: int, guess: float) -> AgreementBound:
        facing = self._facings[0]
        most = self._most_there + len(facing.walls)
        penalty = tightest_penalty(max(guess, 1e-3), most, self._total_walls)
        return AgreementBound([(one.walls, one.says) for one in self._facings], block, penalty)

    def _count_promising(self) -> None:
        bound = self._bound(BLOCK, FIRST_GUESS)
        moving = self._turning.turned(0.0)
        for quarter, bounds in enumerate(bound.over_blocks(moving)):
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
        """Count what may beat the best; how many blocks that was."""
        facing = self._facings[quarter]
        turn = (degrees + 90 * quarter) % 360
        near = self._near_cells if min(turn, 360 - turn) <= self._near_deg else -1.0
        hits = float(self._most_there + min(len(facing.walls), int(np.count_nonzero(moving.says == NEAR))))
        shape = (facing.says.shape[0] // bound.block + 2, facing.says.shape[1] // bound.block + 2)
        true = (facing.true[0] - moving.centre[0], facing.true[1] - moving.centre[1])
        self._best, counted = _best_above(
            bounds,
            bound.block,
            shape,
            (*true, near),
            (facing.walls, facing.says, moving.walls, moving.says, self._total_walls),
            (bound.penalty, hits, SLACK if least is None else np.inf),
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
    """The best agreement of all shifts in blocks whose bound lets them beat ``best``, and how many blocks that are."""
    fixed_walls, fixed_says, moving_walls, moving_says, total_walls = footprints
    penalty, most_hits, slack = limits
    least = least_bound(best, penalty, most_hits, total_walls) - slack
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
                    found = agreement_at(fixed_walls, fixed_says, moving_walls, moving_says, total_walls, row, col)
                    if found > best:
                        best = found
                        least = least_bound(best, penalty, most_hits, total_walls) - slack
    return best, counted
