"""True footprints of a pair of a data set, less the part that a disturbance takes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.truth import PairOverlap
from mapping.io.map_file import load_map
from mapquilt.benchmark.disturbance.kinds import DisturbedMap
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.evaluation.evaluated_pair import GroundTruth
from mapquilt.runs.folder import TRUTH_FILE, TRUTH_FOLDER
from mapquilt.runs.truth_file import load_truth


@dataclass(frozen=True, eq=False)
class TrueFootprints:
    """Footprints of ``target`` and ``source``, rasters of one world frame, and the true transform of the source's
    map."""

    target: OccupancyGrid
    source: OccupancyGrid
    world_from_source: Similarity2

    @staticmethod
    def of(pair: BenchmarkPair) -> TrueFootprints:
        """Load the footprints of two maps of one sample. Raises ``ValueError`` or ``OSError`` naming a bad file."""
        sample = pair.source_file.parent.parent
        names = [file.parent.name for file in (pair.target_file, pair.source_file)]
        target, source = (load_map(sample / TRUTH_FOLDER / f"{name}.yaml").grid for name in names)
        return TrueFootprints(target, source, load_truth(sample / TRUTH_FILE).robot(names[1]).truth.world_from_map)

    def after(self, done: DisturbedMap) -> PairOverlap:
        """Compare the footprints without the cells that the disturbed source no longer knows."""
        cells = np.argwhere(self.source.known)
        on_map = self.world_from_source.inverse().apply(self.source.frame.metres_from_cells(cells))
        places = done.before.frame.cells_from_metres(on_map)
        inside = done.before.frame.contains(places)
        rows, cols = places[inside].T
        lost = cells[inside][done.before.known[rows, cols] & ~done.grid.known[rows, cols]]
        values = np.array(self.source.log_odds)
        values[lost[:, 0], lost[:, 1]] = 0.0
        return PairOverlap.of(self.target, OccupancyGrid(self.source.frame, values))


def with_footprints(truth: GroundTruth, footprints: PairOverlap) -> GroundTruth:
    """State the overlap of a pair and if it has one right answer; footprints with nothing in common have none."""
    if footprints.overlap == 0.0:
        return replace(truth, target_from_source=None, overlap=0.0, residual_m=None)
    identifiable = truth.identifiable and footprints.identifiability.identifiable
    return replace(truth, overlap=footprints.overlap, identifiable=identifiable)
