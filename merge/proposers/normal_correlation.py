"""Proposals from the correlation of walls that face the same way, over scales and likely rotations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from merge.preparation.correlation_pyramid import CorrelationPyramid
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.correlation import Peak, correlate
from merge.proposers.orientation_histogram import correlated, likely_yaws, wall_directions
from merge.records.proposal import Proposal

ALL_ROUND = tuple(math.radians(degrees) for degrees in range(0, 360, 10))


@dataclass(frozen=True, eq=False)
class FacingWalls:
    """What ``NormalCorrelation`` keeps of a map."""

    layers: CorrelationPyramid
    directions: NDArray[np.float64]


@dataclass(frozen=True)
class NormalCorrelation:
    """Over scales and likely rotations, correlation of signed surface normals: for what is too ragged for features.

    - ``scale_step``, ``across``, ``peaks``: the correlation's scales lie no further apart than this factor, its rasters
      have so many cells along the larger map, and each scale and rotation brings so many shifts;
    - ``proposals``: so many of all shifts are proposed;
    - ``contradiction``: what the correlation takes for surface in the other's free space, per cell of length; maps
      that share little are found by contradicting one another little;
    - ``clear``: where wall directions correlate less than this, as in caves, no rotation is likelier than another, and
      all are tried, more coarsely; walls that are turned too far yet to lie on one another contradict less there
      (``coarse_contradiction``).
    """

    scale_step: float = 1.06
    across: int = 112
    peaks: int = 4
    proposals: int = 600
    contradiction: float = 0.7
    coarse_contradiction: float = 0.35
    clear: float = 0.75

    def describe(self, chart: PreparedMap) -> FacingWalls:
        """The rasters to correlate, and the wall directions."""
        return FacingWalls(chart.layers, wall_directions(chart.normals))

    def propose(
        self, target: FacingWalls, source: FacingWalls, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """The highest peaks of the correlation, best first."""
        if correlated(target.directions, source.directions).max() < self.clear:
            coarse, across = scales(scale, self.scale_step**2), self.across // 2
            found = self._peaks(target, source, coarse, ALL_ROUND, across, self.coarse_contradiction)
        else:
            likely = likely_yaws(target.directions, source.directions)
            found = self._peaks(target, source, scales(scale, self.scale_step), likely, self.across, self.contradiction)
        return tuple(Proposal(peak.target_from_source) for peak in found)

    def _peaks(
        self,
        target: FacingWalls,
        source: FacingWalls,
        sizes: Sequence[float],
        yaws: Sequence[float],
        across: int,
        contradiction: float,
    ) -> list[Peak]:
        peaks: list[Peak] = []
        for size in sizes:
            peaks += correlate(target.layers, source.layers, size, yaws, across, self.peaks, contradiction)
        return sorted(peaks, key=lambda peak: -peak.score)[: self.proposals]


def scales(scale: ScaleRange, step: float) -> list[float]:
    """Scales of the range, no further apart than a factor ``step``."""
    if scale.fixed:
        return [scale.low]
    number = math.ceil(math.log(scale.high / scale.low) / math.log(step)) + 1
    return [float(size) for size in np.geomspace(scale.low, scale.high, number)]
