"""What the cells of two maps say of a place that others have told."""

from __future__ import annotations

import math
from collections.abc import Sequence

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet
from merge.alignment.coarse_to_fine import refine
from merge.alignment.deduplication import apart, smaller_diagonal
from merge.alignment.hypotheses import QUICK
from merge.multimap.edge import LocalFrame
from merge.pair.feature_cache import FeatureCache
from merge.preparation.prepared_map import PreparedMap
from merge.verification.wall_overlap import WallOverlap, measure_wall_overlap

POINTS = 400
LEAST_JUDGED = 40.0
"""Cells of wall on which one map must have an opinion of the other, or they say nothing."""

MUCH_JUDGED = 200.0
"""From this length on they say all that they can."""

NEUTRAL = 0.65
"""The share of the judged walls that lies on walls where right and wrong places are equally likely."""

FULL = 0.25
"""So far from that, it is as plain as it gets."""

HOPELESS = 0.4
"""What fits so badly fits no better a little to the side."""

BEST, WORST = 2.0, -3.0
"""Log-odds of a place, at most and at least: walls deep in free space are a plain contradiction."""

STRAY_SHARE = 0.03
"""So far, as a share of the smaller map's diagonal, a told place may be moved to fit: chains of answers add up."""


class OverlapLikelihood:
    """Asked for the log-odds that a source lies at a place on a target, by index; 0 where they share nothing."""

    def __init__(self, maps: MapSet, grounds: Sequence[LocalFrame], shelf: FeatureCache) -> None:
        self._maps, self._grounds, self._shelf = maps, grounds, shelf
        self._heard: dict[tuple[int, int, Similarity2], float] = {}
        self._charts: dict[int, PreparedMap] = {}

    def __call__(self, target: int, source: int, target_from_source: Similarity2) -> float:
        if target > source:
            target, source, target_from_source = source, target, target_from_source.inverse()
        key = target, source, self._rounded(source, target_from_source)
        if key not in self._heard:
            self._heard[key] = self._told(*key)
        return self._heard[key]

    def _rounded(self, source: int, place: Similarity2) -> Similarity2:
        """By a quarter of a cell at most: what hardly moves need not be heard again."""
        turn = 1.0 / self._grounds[source].diagonal
        scale = math.exp(turn * round(math.log(place.scale) / turn))
        return Similarity2(
            round(2.0 * place.x) / 2.0, round(2.0 * place.y) / 2.0, turn * round(place.yaw / turn), scale
        )

    def _told(self, target: int, source: int, target_from_source: Similarity2) -> float:
        if not self.may_meet(target, source, target_from_source):
            return 0.0
        target_chart, source_chart = self.chart(target), self.chart(source)
        place = on_charts(target_chart, source_chart, target_from_source)
        walls = measure_wall_overlap(target_chart, source_chart, place, POINTS)
        if HOPELESS < _share(walls) < NEUTRAL + FULL and walls.compared_length >= LEAST_JUDGED:
            walls = _fitted(target_chart, source_chart, place, walls)
        if walls.compared_length < LEAST_JUDGED:
            return 0.0
        plain = (_share(walls) - NEUTRAL) / FULL
        told = BEST * plain if plain > 0.0 else -WORST * plain
        return min(BEST, max(WORST, told)) * min(1.0, walls.compared_length / MUCH_JUDGED)

    def chart(self, index: int) -> PreparedMap:
        if index not in self._charts:
            self._charts[index] = self._shelf.chart(self._maps.grids[index])
        return self._charts[index]

    def may_meet(self, target: int, source: int, target_from_source: Similarity2) -> bool:
        """Whether the circles around the two overlap."""
        there, here = self._grounds[target], self._grounds[source]
        reach = there.diagonal + target_from_source.scale * here.diagonal
        # The middle of the walls may lie off the middle of the map, but not by more than half the diagonal.
        return math.hypot(target_from_source.x, target_from_source.y) < reach


def on_charts(target: PreparedMap, source: PreparedMap, local: Similarity2) -> Similarity2:
    """A transform between local frames (``LocalFrame``) as one between cells of the charts."""
    there = Similarity2(float(target.middle[0]), float(target.middle[1]))
    return there @ local @ Similarity2(float(source.middle[0]), float(source.middle[1])).inverse()


def _share(walls: WallOverlap) -> float:
    return walls.inlier_length / walls.compared_length if walls.compared_length > 0.0 else 0.0


def _fitted(target: PreparedMap, source: PreparedMap, place: Similarity2, walls: WallOverlap) -> WallOverlap:
    scale = ScaleRange(place.scale, place.scale)
    answer = refine(target, source, place, scale, QUICK)
    stray = float(apart(source, [place, answer])[0, 1])
    if stray > STRAY_SHARE * smaller_diagonal(target, source, place.scale):
        return walls
    better = measure_wall_overlap(target, source, answer, POINTS)
    return better if _share(better) > _share(walls) else walls
