"""The method of chapter 5: correct both maps, match their corners, refine on the walls."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.validation import require_valid
from merge.literature.acceptance import no_answer
from merge.literature.chen2021.corner_consensus import ConsensusSettings, CornerMatch, corner_consensus
from merge.literature.chen2021.correction import Correction, CorrectionSettings, corrected
from merge.literature.chen2021.interest_points import dilated
from merge.literature.chen2021.ransac import accept_by_index
from merge.literature.chen2021.sift import Features, Sift
from merge.literature.chen2021.wall_icp import IcpSettings, WallCells, icp
from merge.preparation.map_image import cells_from_pixels, trinary_picture
from merge.preparation.prepared_map import PreparedMap
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal
from merge.verification.cell_overlap import compare_cells


@dataclass(frozen=True, eq=False)
class CorrectedMap:
    """A map with its correction, its corners (N, 2) and its wall cells, in cells of a ``PreparedMap``.

    ``lean`` [rad] is the direction in the map, counter-clockwise, that the correction rotated onto its rows.
    """

    grid: OccupancyGrid
    correction: Correction
    corners: NDArray[np.float64]
    lean: float
    walls: WallCells

    @staticmethod
    def of(grid: OccupancyGrid, gate_cells: float, settings: CorrectionSettings) -> CorrectedMap:
        correction = corrected(trinary_picture(grid), settings)
        pixels = correction.straightened.before(correction.corners)
        corners = cells_from_pixels(pixels, grid.frame.shape[0])
        lean = -correction.direction.angle  # v points down
        return CorrectedMap(grid, correction, corners, lean, WallCells.of(grid, math.ceil(gate_cells)))


@dataclass(frozen=True)
class Morphology:
    """Chen 2021, chapter 5, without manual parameters and without randomness.

    At most ``proposals`` similarities are refined and proposed. As published, the best of each quarter turn is refined,
    and the greatest acceptance index wins; an answer is refused if one map would be ``max_scale`` times as large as the
    other.

    ``without`` leaves out what follows the correction, as published only: without "consensus" SIFT describes the
    corrected picture, and chapter 4 matches it as ``sift`` says; without "icp" nothing is refined.
    """

    proposals: int = 8
    max_scale: float = 10.0
    correction: CorrectionSettings = field(default_factory=CorrectionSettings)
    consensus: ConsensusSettings = field(default_factory=ConsensusSettings)
    icp: IcpSettings = field(default_factory=IcpSettings)
    sift: Sift = field(default_factory=Sift.as_published)
    without: Literal["consensus", "icp"] | None = None

    def __post_init__(self) -> None:
        require_valid(self)

    def describe(self, prepared: PreparedMap) -> CorrectedMap:
        """Correct the map."""
        return CorrectedMap.of(prepared.grid, self.icp.gate_cells, self.correction)

    def propose(
        self, target: CorrectedMap, source: CorrectedMap, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose similarities of most corner pairs, refined on the walls; none if too few corners match."""
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
        """Return the answer of the greatest acceptance index, which is its confidence: the thesis has no threshold."""
        best = no_answer()
        for start in self._starts(target, source, scale, rng):
            settled = start
            if self.without != "icp":
                settled = icp(target.walls, source.walls, start, scale, self.icp)
            index = compare_cells(target.grid, source.grid, settled).acceptance_index
            answer = accept_by_index(settled, index, self.max_scale)
            if answer.verdict.confidence > best.verdict.confidence:
                best = answer
        return best

    def _starts(
        self, target: CorrectedMap, source: CorrectedMap, scale: ScaleRange, rng: np.random.Generator
    ) -> list[Similarity2]:
        if self.without != "consensus":
            return [each.target_from_source for each in best_of_each_quadrant(self.agreed(target, source, scale))]
        found = self.sift.sampled(self._features(target), self._features(source), rng)
        return [] if found is None else [found]

    def _features(self, corrected: CorrectedMap) -> Features:
        """Detect SIFT features on the walls of the corrected picture (section 5.6)."""
        found = corrected.correction
        pixels, descriptors = self.sift.detect(found.structure)
        walls = dilated(found.structure, found.half)
        u, v = np.rint(pixels).astype(np.intp).T
        kept = walls[np.clip(v, 0, walls.shape[0] - 1), np.clip(u, 0, walls.shape[1] - 1)] > 0
        cells = cells_from_pixels(found.straightened.before(pixels[kept]), corrected.grid.frame.shape[0])
        return Features(cells, descriptors[kept], corrected.grid)

    def agreed(self, target: CorrectedMap, source: CorrectedMap, scale: ScaleRange) -> list[CornerMatch]:
        """Find the similarities with most corner pairs, by falling number."""
        turns = None
        if target.correction.direction.clear and source.correction.direction.clear:
            turns = [target.lean - source.lean + k * math.pi / 2.0 for k in range(4)]
        return corner_consensus(target.corners, source.corners, turns, scale, self.consensus)


def best_of_each_quadrant(found: list[CornerMatch]) -> list[CornerMatch]:
    """Select the first similarity in each of the four quadrants of the rotation.

    Chapter 5 leaves four rotations open, as chapter 6 does by its four pairs of clusters.
    """
    if not found:
        return []
    best: dict[int, CornerMatch] = {}
    for each in found:
        off = each.target_from_source.yaw - found[0].target_from_source.yaw
        best.setdefault(round(off / (math.pi / 2.0)) % 4, each)
    return list(best.values())
