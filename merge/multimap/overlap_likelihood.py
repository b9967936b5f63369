"""Likelihood of a relative pose from the cells of two maps."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Sequence

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet
from merge.alignment.coarse_to_fine import refine
from merge.alignment.deduplication import rms_displacement
from merge.alignment.settings import AlignmentSettings
from merge.multimap.graph import LocalFrame
from merge.multimap.settings import OverlapLikelihoodSettings
from merge.pair.feature_cache import FeatureCache
from merge.preparation.prepared_map import PreparedMap, smaller_diagonal
from merge.verification.wall_overlap import WallOverlap, measure_wall_overlap


class OverlapLikelihood:
    """Evaluate the log-odds that ``target_from_source`` between two maps is right: see ``PairLikelihood``.

    Poses are rounded to a quarter of a cell at most, and results kept.
    """

    def __init__(
        self,
        maps: MapSet,
        frames: Sequence[LocalFrame],
        cache: FeatureCache,
        settings: OverlapLikelihoodSettings = OverlapLikelihoodSettings(),
        alignment: AlignmentSettings = AlignmentSettings(),
    ) -> None:
        self._alignment = alignment
        self._maps, self._frames, self._cache, self._settings = maps, frames, cache, settings
        self._known: dict[tuple[int, int, Similarity2], float] = {}
        self._prepared: OrderedDict[int, PreparedMap] = OrderedDict()
        self._held_cells = 0

    def __call__(self, target: int, source: int, target_from_source: Similarity2) -> float:
        if target > source:
            target, source, target_from_source = source, target, target_from_source.inverse()
        key = target, source, self._rounded(source, target_from_source)
        if key not in self._known:
            self._known[key] = self._log_odds(*key)
        return self._known[key]

    def prepared(self, index: int) -> PreparedMap:
        """Return the prepared map of an index."""
        if index not in self._prepared:
            found = self._cache.prepared(self._maps.grids[index])
            self._prepared[index] = found
            self._held_cells += found.grid.log_odds.size
            while self._held_cells > self._settings.prepared_cells and len(self._prepared) > 2:
                self._held_cells -= self._prepared.popitem(last=False)[1].grid.log_odds.size
        self._prepared.move_to_end(index)
        return self._prepared[index]

    def forget_prepared(self) -> None:
        """Free the memory of the prepared maps."""
        self._prepared.clear()
        self._cache.clear()
        self._held_cells = 0

    def _rounded(self, source: int, pose: Similarity2) -> Similarity2:
        step = 1.0 / self._frames[source].diagonal
        scale = math.exp(step * round(math.log(pose.scale) / step))
        return Similarity2(round(2.0 * pose.x) / 2.0, round(2.0 * pose.y) / 2.0, step * round(pose.yaw / step), scale)

    def _log_odds(self, target: int, source: int, target_from_source: Similarity2) -> float:
        if not self._may_overlap(target, source, target_from_source):
            return 0.0
        limits = self._settings
        maps = self.prepared(target), self.prepared(source)
        pose = prepared_from_local(*maps, target_from_source)
        walls = measure_wall_overlap(*maps, pose, limits.points, self._alignment.overlap)
        promising = limits.hopeless_fraction < _inlier_fraction(walls) < limits.neutral_fraction + limits.saturation
        if promising and walls.compared_length >= limits.min_compared_cells:
            walls = self._refined(*maps, pose, walls)
        if walls.compared_length < limits.min_compared_cells:
            return 0.0
        evidence = (_inlier_fraction(walls) - limits.neutral_fraction) / limits.saturation
        log_odds = limits.max_log_odds * evidence if evidence > 0.0 else -limits.min_log_odds * evidence
        bounded = min(limits.max_log_odds, max(limits.min_log_odds, log_odds))
        return bounded * min(1.0, walls.compared_length / limits.full_compared_cells)

    def _may_overlap(self, target: int, source: int, target_from_source: Similarity2) -> bool:
        """Test if circles around the two maps overlap."""
        # The middle of the walls may lie off the middle of the map, but not by more than half the diagonal.
        reach = self._frames[target].diagonal + target_from_source.scale * self._frames[source].diagonal
        return math.hypot(target_from_source.x, target_from_source.y) < reach

    def _refined(self, target: PreparedMap, source: PreparedMap, pose: Similarity2, walls: WallOverlap) -> WallOverlap:
        """Measure the overlap after a quick refinement, if that stays near and fits better."""
        scale, alignment = ScaleRange(pose.scale, pose.scale), self._alignment
        answer = refine(target, source, pose, scale, alignment.quick, alignment)
        shift = float(rms_displacement(source, [pose, answer])[0, 1])
        if shift > self._settings.max_shift_share * smaller_diagonal(target, source, pose.scale):
            return walls
        better = measure_wall_overlap(target, source, answer, self._settings.points, alignment.overlap)
        return better if _inlier_fraction(better) > _inlier_fraction(walls) else walls


def prepared_from_local(target: PreparedMap, source: PreparedMap, local: Similarity2) -> Similarity2:
    """Express a transform between local frames (``LocalFrame``) between cells of the prepared map maps."""
    to_target = Similarity2(float(target.middle[0]), float(target.middle[1]))
    return to_target @ local @ Similarity2(float(source.middle[0]), float(source.middle[1])).inverse()


def _inlier_fraction(walls: WallOverlap) -> float:
    return walls.inlier_length / walls.compared_length if walls.compared_length > 0.0 else 0.0
