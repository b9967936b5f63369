"""The method of chapter 5 as a whole: correct both maps, match their corners, settle the walls."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.literature.chen2021.corner_consensus import Agreement, ConsensusSettings, agreements
from merge.literature.chen2021.correction import Correction, corrected
from merge.literature.chen2021.ransac import believed_by_index
from merge.literature.chen2021.wall_icp import IcpSettings, WallCells, icp
from merge.literature.published import nothing_found
from merge.preparation.map_image import cells_from_pixels, trinary_picture
from merge.preparation.prepared_map import PreparedMap
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal


@dataclass(frozen=True, eq=False)
class CorrectedMap:
    """A map with its correction, its corners (N, 2) and its wall cells in cells of a ``PreparedMap``. ``lean`` [rad] is
    the direction in the map, counter-clockwise, of what the correction turned onto its rows."""

    grid: OccupancyGrid
    correction: Correction
    corners: NDArray[np.float64]
    lean: float
    walls: WallCells

    @staticmethod
    def of(grid: OccupancyGrid, gate_cells: float) -> CorrectedMap:
        correction = corrected(trinary_picture(grid))
        pixels = correction.straightened.before(correction.corners)
        corners = cells_from_pixels(pixels, grid.frame.shape[0])
        lean = -correction.direction.angle  # v points down
        return CorrectedMap(grid, correction, corners, lean, WallCells.of(grid, math.ceil(gate_cells)))


@dataclass(frozen=True)
class Morphology:
    """Chen 2021, chapter 5, without a number set by hand and without chance.

    ``proposals`` agreements at most are settled and proposed; as published, the best of each quarter turn is settled,
    and the greatest acceptance index wins.
    """

    proposals: int = 8
    consensus: ConsensusSettings = field(default_factory=ConsensusSettings)
    icp: IcpSettings = field(default_factory=IcpSettings)

    def __post_init__(self) -> None:
        if self.proposals < 1:
            raise ValueError(f"Morphology: proposals is {self.proposals}, must be at least 1")

    def describe(self, chart: PreparedMap) -> CorrectedMap:
        """The map corrected."""
        return CorrectedMap.of(chart.grid, self.icp.gate_cells)

    def propose(
        self, target: CorrectedMap, source: CorrectedMap, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Similarities that most corners agree on, settled on the walls; empty where too few agree."""
        found = self.agreed(target, source, scale)[: self.proposals]
        return tuple(
            Proposal(
                icp(target.walls, source.walls, each.target_from_source, scale, self.icp), each.matches, each.inliers
            )
            for each in found
        )

    def published(
        self, target: CorrectedMap, source: CorrectedMap, scale: ScaleRange, rng: np.random.Generator
    ) -> PairAnswer:
        """The answer of the greatest acceptance index, which is its confidence: the thesis has no threshold."""
        best = nothing_found()
        for each in one_a_quarter(self.agreed(target, source, scale)):
            settled = icp(target.walls, source.walls, each.target_from_source, scale, self.icp)
            answer = believed_by_index(target.grid, source.grid, settled)
            if answer.verdict.confidence > best.verdict.confidence:
                best = answer
        return best

    def agreed(self, target: CorrectedMap, source: CorrectedMap, scale: ScaleRange) -> list[Agreement]:
        """What the corners of both maps agree on, most first."""
        turns = None
        if target.correction.direction.clear and source.correction.direction.clear:
            turns = [target.lean - source.lean + k * math.pi / 2.0 for k in range(4)]
        return agreements(target.corners, source.corners, turns, scale, self.consensus)


def one_a_quarter(found: list[Agreement]) -> list[Agreement]:
    """The first agreement of each of four quarters that the rotation may lie in: chapter 5 leaves four of them open,
    as chapter 6 does by its four pairs of clusters."""
    if not found:
        return []
    best: dict[int, Agreement] = {}
    for each in found:
        off = each.target_from_source.yaw - found[0].target_from_source.yaw
        best.setdefault(round(off / (math.pi / 2.0)) % 4, each)
    return list(best.values())
