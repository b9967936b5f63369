"""Proposals from the correlation of walls of the same orientation, over scales and likely rotations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.validation import require_valid
from merge.preparation.correlation_pyramid import CorrelationPyramid
from merge.preparation.prepared_map import PreparedMap
from merge.progress import track
from merge.proposers.correlation import CorrelationSettings, Peak, correlate
from merge.proposers.orientation_histogram import (
    OrientationSettings,
    correlate_histograms,
    likely_yaws,
    orientation_histogram,
)
from merge.records.proposal import Proposal


@dataclass(frozen=True, eq=False)
class WallRasters:
    """Rasters of a map to correlate, and its orientation histogram."""

    layers: CorrelationPyramid
    orientations: NDArray[np.float64]


@dataclass(frozen=True)
class NormalCorrelation:
    """Correlate signed wall normals over scales and likely rotations, for maps too ragged for features.

    - ``scale_step``: largest factor between neighbouring scales;
    - ``proposals``: the best of all shifts are proposed;
    - ``min_orientation_correlation``: below it, as in caves, no rotation is likelier than another: all are tried,
      ``coarse_yaw_step_deg`` apart;
    - ``fine``: correlation at the likely rotations. Maps that share little are found because they contradict one
      another little;
    - ``coarse``: correlation at all rotations. Walls that are rotated too far to match contradict less there;
    - ``orientation``: the likely rotations.
    """

    scale_step: float = 1.06
    proposals: int = 600
    min_orientation_correlation: float = 0.75
    coarse_yaw_step_deg: float = 10.0
    fine: CorrelationSettings = field(default_factory=lambda: CorrelationSettings(contradiction=0.7))
    coarse: CorrelationSettings = field(default_factory=lambda: CorrelationSettings(cells=56))
    orientation: OrientationSettings = field(default_factory=OrientationSettings)

    def __post_init__(self) -> None:
        require_valid(self)
        if self.scale_step <= 1.0:
            raise ValueError(f"NormalCorrelation: scale_step is {self.scale_step}, must be greater than 1")

    def describe(self, prepared: PreparedMap) -> WallRasters:
        """Compute the rasters and the orientation histogram of a map."""
        return WallRasters(prepared.layers, orientation_histogram(prepared.normals, self.orientation))

    def propose(
        self, target: WallRasters, source: WallRasters, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose the highest peaks of the correlation, best first."""
        correlation = correlate_histograms(target.orientations, source.orientations).max()
        if correlation < self.min_orientation_correlation:
            all_yaws = [math.radians(degrees) for degrees in np.arange(0.0, 360.0, self.coarse_yaw_step_deg).tolist()]
            found = self._peaks(target, source, scales(scale, self.scale_step**2), all_yaws, self.coarse)
        else:
            yaws = likely_yaws(target.orientations, source.orientations, self.orientation)
            found = self._peaks(target, source, scales(scale, self.scale_step), yaws, self.fine)
        return tuple(Proposal(peak.target_from_source) for peak in found)

    def _peaks(
        self,
        target: WallRasters,
        source: WallRasters,
        sizes: Sequence[float],
        yaws: Sequence[float],
        settings: CorrelationSettings,
    ) -> list[Peak]:
        peaks: list[Peak] = []
        for size in track(sizes, "scales"):
            peaks += correlate(target.layers, source.layers, size, yaws, settings)
        return sorted(peaks, key=lambda peak: -peak.score)[: self.proposals]


def scales(scale: ScaleRange, step: float) -> list[float]:
    """List scales of the range in geometric sequence, at most a factor ``step`` apart."""
    if scale.fixed:
        return [scale.low]
    number = math.ceil(math.log(scale.high / scale.low) / math.log(step)) + 1
    return [float(size) for size in np.geomspace(scale.low, scale.high, number)]
