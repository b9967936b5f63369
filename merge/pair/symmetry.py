"""Symmetry of the place that a pair shows: turned by 180 degrees it looks the same, so that two placements fit alike.

Two maps of opposite halves of such a building fit as well as two maps of one half. If the halves share little, the
pair has no second best that says so. But what each map shows may: its walls lie on its own walls turned about the
middle of the building. Quarter turns need no search: a place that they leave alike looks the same after two of them.
Repeated rooms need none either, because beside them the answer has a second best.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.alignment.contradiction import measure_contradiction
from merge.alignment.deduplication import deduplicate
from merge.alignment.elastic import bend_onto
from merge.alignment.hypotheses import Hypothesis, rank_proposals, refine_proposals
from merge.alignment.settings import AlignmentSettings
from merge.pair.settings import SymmetrySettings
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.correlation import CorrelationSettings, correlate
from merge.records.proposal import Proposal
from merge.verification.wall_overlap import measure_wall_overlap


@dataclass(frozen=True)
class HalfTurns:
    """Describe a map by the half turns that may be symmetries of its place."""

    symmetry: SymmetrySettings
    alignment: AlignmentSettings

    def describe(self, prepared: PreparedMap) -> tuple[Similarity2, ...]:
        """Return the half turns, cells to cells, after which enough walls lie on walls and few contradict."""
        settings, layers, alignment = self.symmetry, prepared.layers, self.alignment
        peaks = correlate(layers, layers, 1.0, [math.pi], CorrelationSettings(peaks=settings.peaks))
        proposals = [Proposal(peak.target_from_source) for peak in peaks]
        rough = rank_proposals(prepared, prepared, proposals, ScaleRange.known(), alignment)
        promising = [one.proposal for one in rough if self._may_be(prepared, one, settings.min_rough_ratio)]
        found = refine_proposals(prepared, prepared, promising, ScaleRange.known(), alignment)
        return tuple(one.target_from_source for one in found if self._may_be(prepared, one, settings.min_self_ratio))

    def _may_be(self, prepared: PreparedMap, turned: Hypothesis, min_ratio: float) -> bool:
        walls = turned.overlap
        enough = walls.inlier_length >= self.symmetry.min_self_share * len(prepared.points)
        return enough and (walls.inlier_ratio or 0.0) >= min_ratio


def other_placement(
    maps: tuple[PreparedMap, PreparedMap],
    half_turns: Sequence[Similarity2],
    answer: Similarity2,
    level: int,
    settings: SymmetrySettings,
    alignment: AlignmentSettings,
) -> Similarity2 | None:
    """Return the placement of the source that a symmetry of the place makes alike; None if the place is not symmetric.

    The place, as both maps show it at the answer, is compared with itself after each half turn of the target's cells.
    It is symmetric if enough of its walls lie on each other, in more than one direction, and if they contradict little
    more than the two maps do at the answer: by the loosest tolerance, and by that of the ``level`` after a bend.
    """
    target, source = maps
    pair = (_Part(target, source, answer, 1.0),)
    ratio = _walls(pair, alignment).inlier_ratio - settings.max_ratio_loss
    least = settings.min_share * (len(target.points) + answer.scale * len(source.points))
    fits = []
    for turn in half_turns:
        walls = _walls(_turned(target, source, answer, turn), alignment)
        spread = walls.normal_isotropy >= settings.min_normal_isotropy
        if walls.inlier_ratio >= ratio and walls.inlier_length >= least and spread:
            fits.append((walls.inlier_ratio, Proposal(turn @ answer)))
    if not fits:
        return None
    violation = _violation(pair, level, alignment)
    if violation > settings.max_violation:
        return None
    limit = min(settings.max_violation, violation + settings.max_more_violation)
    best_first = [proposal for _, proposal in sorted(fits, key=lambda fit: -fit[0])]
    others = deduplicate(target, source, [Proposal(answer), *best_first], alignment.hypotheses.distinct_share)[1:]
    for other in others:
        turn = other.target_from_source @ answer.inverse()
        if _violation(_turned(target, source, answer, turn), level, alignment) <= limit:
            return other.target_from_source
    return None


@dataclass(frozen=True, eq=False)
class _Part:
    """Two maps to compare, ``above`` moved onto ``below``; ``weight`` converts lengths to cells of the target."""

    below: PreparedMap
    above: PreparedMap
    below_from_above: Similarity2
    weight: float


@dataclass(frozen=True)
class _Walls:
    """Walls of all parts together that are compared, and those that match [cells of the target]."""

    inlier_length: float
    compared_length: float
    normal_isotropy: float

    @property
    def inlier_ratio(self) -> float:
        return self.inlier_length / self.compared_length if self.compared_length > 0.0 else 0.0


def _turned(target: PreparedMap, source: PreparedMap, answer: Similarity2, turn: Similarity2) -> tuple[_Part, ...]:
    """List the parts of the place under itself turned: each map under itself, and each under the other."""
    return (
        _Part(target, target, turn, 1.0),
        _Part(source, source, answer.inverse() @ turn @ answer, answer.scale),
        _Part(target, source, turn @ answer, 2.0 * max(1.0, answer.scale)),
    )


def _walls(parts: Sequence[_Part], settings: AlignmentSettings) -> _Walls:
    points, overlap = settings.hypotheses.final_points, settings.overlap
    found = [measure_wall_overlap(one.below, one.above, one.below_from_above, points, overlap) for one in parts]
    weights = [one.weight for one in parts]
    inlier = sum(w * one.inlier_length for w, one in zip(weights, found, strict=True))
    compared = sum(w * one.compared_length for w, one in zip(weights, found, strict=True))
    isotropy = sum(w * one.inlier_length * one.normal_isotropy for w, one in zip(weights, found, strict=True))
    return _Walls(inlier, compared, isotropy / inlier if inlier > 0.0 else 0.0)


def _violation(parts: Sequence[_Part], level: int, settings: AlignmentSettings) -> float:
    """Return the share of the compared walls that contradict after a bend (``Contradiction``), over all parts."""
    ratios, strict = [], replace(settings, contradiction=replace(settings.contradiction, level=level))
    for one in parts:
        maps = one.below, one.above, one.below_from_above
        bend = bend_onto(*maps, settings.elastic)
        ratios.append(measure_contradiction(*maps, bend, strict).violation_ratio or 0.0)
    lengths = [_walls((one,), settings).compared_length for one in parts]
    return float(np.average(ratios, weights=lengths)) if sum(lengths) > 0.0 else 0.0
