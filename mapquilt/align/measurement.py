"""Measurements of a placement while it is dragged: wall overlap, contradiction, score, and the class of each wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet
from mapping.validation import require_valid
from merge.pair.feature_cache import FeatureCache, metres_from_prepared
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.surface import thinned
from merge.settings import MergeSettings
from merge.verification.wall_overlap import WallOverlap, classify_walls, measure_wall_overlap, tolerance_cells

NO_OPINION, MATCH, CONTRADICTION = 0, 1, 2
"""Classes of a wall point: the other map says nothing, has the same wall, or has free space there."""


@dataclass(frozen=True)
class SampleSettings:
    """Settings of the measurements during a drag.

    - ``max_points``: wall points of a map that are measured and coloured; 3,000 take 10 ms for a pair, and their score
      differs by at most 0.015 from that of all points of maps with 9,000.
    """

    max_points: int = 3000

    def __post_init__(self) -> None:
        require_valid(self)


@dataclass(frozen=True, eq=False)
class Measured:
    """The overlap of the walls of two maps, and the classes (N,) of the wall points of target and source."""

    overlap: WallOverlap
    target_classes: NDArray[np.uint8]
    source_classes: NDArray[np.uint8]


class PairMeasurer:
    """Measure placements of the maps of a set."""

    def __init__(self, maps: MapSet, settings: MergeSettings, sample: SampleSettings = SampleSettings()) -> None:
        self._maps, self._settings, self._sample = maps, settings, sample
        self._cache = FeatureCache(settings.preparation, kept=len(maps))

    def wall_points(self, index: int) -> NDArray[np.float64]:
        """Return the wall points (N, 2) of a map that are classified [stated metres]."""
        prepared = self._prepared(index)
        kept, _ = thinned(len(prepared.points), self._sample.max_points)
        return self._metres(index).apply(prepared.points[kept])

    def measure(self, target: int, source: int, target_from_source: Similarity2) -> Measured:
        """Measure a transform of one map to another, in stated metres, on a sample of their walls."""
        settings = self._settings.alignment.overlap
        there, here = self._prepared(target), self._prepared(source)
        cells = self._metres(target).inverse() @ target_from_source @ self._metres(source)
        overlap = measure_wall_overlap(there, here, cells, self._sample.max_points, settings)
        tolerance = tolerance_cells(there, here, cells.scale, settings)
        return Measured(
            overlap,
            self._classes(here, there, cells.inverse(), tolerance / cells.scale),
            self._classes(there, here, cells, tolerance),
        )

    def _classes(
        self, below: PreparedMap, above: PreparedMap, below_from_above: Similarity2, tolerance: float
    ) -> NDArray[np.uint8]:
        kept, _ = thinned(len(above.points), self._sample.max_points)
        cosine = self._settings.alignment.overlap.min_normal_cosine
        found = classify_walls(below.surface, above.surface, kept, below_from_above, tolerance, cosine)
        return np.select([found[:, 0] > 0.0, found[:, 1:].any(axis=1)], [MATCH, CONTRADICTION], NO_OPINION).astype(
            np.uint8
        )

    def _prepared(self, index: int) -> PreparedMap:
        return self._cache.prepared(self._maps.grids[index])

    def _metres(self, index: int) -> Similarity2:
        return metres_from_prepared(self._maps.grids[index].frame, self._prepared(index))


def combine_classes(classes: list[NDArray[np.uint8]], length: int) -> NDArray[np.uint8]:
    """Combine the opinions of several maps on the same wall points: any match decides, then any contradiction."""
    either = np.zeros(length, np.uint8)
    for each in classes:
        either = np.where((each == MATCH) | (either == NO_OPINION), each, either)
    return either
