"""Priors: start poses of maps that are roughly known before the merge."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import wrap_angle
from mapping.geometry.similarity2 import Similarity2
from mapping.validation import require_valid
from merge.records.pair_answer import RIGHT_GROWTH, RIGHT_YAW

SIGMA = 1.0
"""Standard deviation [m] of a start pose for which none is given."""


@dataclass(frozen=True)
class PriorSettings:
    """Use of start poses.

    - ``yaw_sigma`` [rad]: standard deviation of the yaw of a start pose;
    - ``max_deviations``: an answer further away than so many standard deviations contradicts the prior;
    - ``tolerance_share`` [of the placed map's diagonal]: an answer may be so far off and is right, so that it may lie
      that far outside;
    - ``step_share`` [of the target's diagonal]: distance of the starts of a search; refinement reaches further;
    - ``scale_step``: factor between the scales of the starts; refinement reaches further;
    - ``max_starts``: a search has no more starts; ``coarser``: factor on all steps until it has not;
    - ``contradiction_log_odds``: of a pose of a team that contradicts a prior; no answers outweigh it.
    """

    yaw_sigma: float = math.radians(10.0)
    max_deviations: float = 3.0
    tolerance_share: float = 0.015
    step_share: float = 0.04
    scale_step: float = 1.12
    max_starts: int = 1500
    coarser: float = 1.2
    contradiction_log_odds: float = -1000.0

    def __post_init__(self) -> None:
        require_valid(self, signed=("contradiction_log_odds",))


@dataclass(frozen=True)
class Prior:
    """Start pose of a map in a frame that all priors share: x, y [m], yaw [rad].

    ``sigma`` [m] is the standard deviation of its shift.

    Raises ``ValueError`` that names a value that is not finite or not positive, or a yaw that must be one in degrees.
    """

    name: str
    x: float
    y: float
    yaw: float
    sigma: float = SIGMA

    def __post_init__(self) -> None:
        for name in ("x", "y", "yaw", "sigma"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"prior of {self.name}: {name} is {getattr(self, name)}, must be finite")
        if not self.sigma > 0.0:
            raise ValueError(f"prior of {self.name}: sigma is {self.sigma:g}, must be positive")
        if abs(self.yaw) > math.tau:
            raise ValueError(
                f"prior of {self.name}: yaw is {self.yaw:g} rad, must lie within a turn (6.28 rad) either way; "
                f"write {self.yaw:g}deg if it is in degrees"
            )

    @property
    def common_from_map(self) -> Similarity2:
        return Similarity2(self.x, self.y, self.yaw)


@dataclass(frozen=True)
class Extent:
    """Extent of a map [stated metres]: its ``diagonal``, and the distance ``arm`` of its walls from its origin."""

    diagonal: float = 0.0
    arm: float = 0.0


@dataclass(frozen=True)
class Expected:
    """Expected pose of a source on a target, and the standard deviation of its shift [m].

    - ``target_from_source``: at scale 1, in metres of the frame that the priors share;
    - ``scale``: bounds of the scale of an answer [stated metres of the target per stated metre of the source];
    - ``metre``: metres of the shared frame per stated metre of the target: 1 if that is the reference or all scales are
      known;
    - ``extent``: of the source;
    - ``inverted``: True if all this is of the target on the source, because the source is the reference.
    """

    target_from_source: Similarity2
    sigma: float
    settings: PriorSettings = PriorSettings()
    scale: ScaleRange = field(default_factory=ScaleRange)
    metre: ScaleRange = field(default_factory=ScaleRange)
    extent: Extent = Extent()
    inverted: bool = False

    @staticmethod
    def of(target: Prior, source: Prior, settings: PriorSettings = PriorSettings()) -> Expected:
        relative = target.common_from_map.inverse() @ source.common_from_map
        return Expected(relative, math.hypot(target.sigma, source.sigma), settings)

    def allows(self, found: Similarity2) -> bool:
        """Test if an answer agrees with the prior: by the position of the source's origin, and by its yaw.

        An answer counts as right that is slightly off, and so does one that is as far outside of what the prior allows.
        """
        if self.inverted:
            return replace(self, inverted=False).allows(found.inverse())
        most, metre = self.settings.max_deviations, self._metre(found)
        shift, turn = self.distance(found)
        slope = RIGHT_YAW + (0.0 if self.scale.fixed else RIGHT_GROWTH)
        tolerance = self.settings.tolerance_share * self.extent.diagonal + slope * self.extent.arm
        return shift <= most * self.sigma + metre * found.scale * tolerance and turn <= most * self.settings.yaw_sigma

    def distance(self, found: Similarity2) -> tuple[float, float]:
        """Return how far an answer is from the expected pose: shift [m of the shared frame] and turn [rad]."""
        if self.inverted:
            return replace(self, inverted=False).distance(found.inverse())
        expected, metre = self.target_from_source, self._metre(found)
        shift = math.hypot(metre * found.x - expected.x, metre * found.y - expected.y)
        return shift, abs(wrap_angle(found.yaw - expected.yaw))

    def _metre(self, found: Similarity2) -> float:
        """Return the metres of the shared frame per stated metre that bring an answer nearest to the expected pose."""
        square = found.x**2 + found.y**2
        along = found.x * self.target_from_source.x + found.y * self.target_from_source.y
        return self.metre.clip(along / square) if square > 0.0 else 1.0

    def starts(self, diagonal: float, target_metres: Similarity2, source_metres: Similarity2) -> list[Similarity2]:
        """List transforms around the expected one, cells to cells, so dense that refinement finds the answer.

        Every scale is tried that an answer may have. ``diagonal`` is that of the target [cells]; the others go from
        cells to metres.
        """
        if self.inverted:
            other = replace(self, inverted=False, scale=self.scale.inverse())
            same = diagonal * target_metres.scale / source_metres.scale
            return [start.inverse() for start in other.starts(same, source_metres, target_metres)]
        limits, expected = self.settings, self.target_from_source
        step = limits.step_share * diagonal * target_metres.scale
        swing = step / max(1e-9, self.extent.arm * self.scale.middle)
        turn_step, growth_step = min(limits.yaw_sigma, swing), min(math.log(limits.scale_step), swing)
        while True:
            shifts, turns = _around(2.0 * self.sigma, step), _around(2.0 * limits.yaw_sigma, turn_step)
            scales, metres = _spaced(self.scale, growth_step), _spaced(self.metre, growth_step)
            if len(shifts) ** 2 * len(turns) * len(scales) * len(metres) <= limits.max_starts:
                break
            step, turn_step, growth_step = (limits.coarser * each for each in (step, turn_step, growth_step))
        return [
            target_metres.inverse()
            @ Similarity2((expected.x + dx) / metre, (expected.y + dy) / metre, expected.yaw + turn, scale)
            @ source_metres
            for scale in scales
            for metre in metres
            for turn in turns
            for dx in shifts
            for dy in shifts
        ]


def _around(reach: float, step: float) -> list[float]:
    """List numbers from minus the reach to the reach, about a step apart, 0 among them."""
    number = math.ceil(reach / step - 0.5)
    return np.linspace(-reach, reach, 2 * number + 1).tolist() if number else [0.0]


def _spaced(scale: ScaleRange, step: float) -> list[float]:
    """List scales, even in logarithms: the logarithm of every scale of the range is at most a step from one of them."""
    number = max(1, math.ceil(math.log(scale.high / scale.low) / (2.0 * step) - 1e-9))
    edges: NDArray[np.float64] = np.linspace(math.log(scale.low), math.log(scale.high), 2 * number + 1)
    return [math.exp(edge) for edge in edges[1::2].tolist()]


def require_relative(priors: Sequence[Prior], reference: str | None) -> None:
    """Require that priors place maps relative to others. Raises ``ValueError`` naming a map."""
    names = [prior.name for prior in priors]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"prior: {name} has more than one")
    if names == [reference]:
        raise ValueError(
            f"prior: that of {reference} alone says nothing, since it is the reference; give another map's"
        )


def shared_frame(priors: Sequence[Prior], reference: str | None, names: Sequence[str]) -> str | None:
    """Return the map in whose frame the priors are, None if it is none of ``names``.

    That is the reference. Without one, a single prior is in the frame of the first other map.
    """
    if reference is None and len(priors) == 1:
        return next((name for name in names if name != priors[0].name), None)
    return reference


def expected_poses(
    priors: Sequence[Prior],
    reference: str | None,
    settings: PriorSettings = PriorSettings(),
    scale: ScaleRange | None = None,
    extents: Mapping[str, Extent] | None = None,
) -> dict[tuple[str, str], Expected]:
    """Return the expected pose of each two maps with priors, both ways; a reference without one lies at the origin.

    ``scale`` bounds the scale between any two maps, which is 1 by default; ``extents`` are those of the maps. The
    metres of the priors are those that the reference states; without a reference they are those of some map, whose
    scale is known only within the bounds.

    Raises ``ValueError`` if a map has two priors, or only the reference has one.
    """
    require_relative(priors, reference)
    if priors and reference is not None and reference not in [prior.name for prior in priors]:
        priors = [*priors, Prior(reference, 0.0, 0.0, 0.0, 1e-3)]
    scale = scale or ScaleRange.known()
    either = ScaleRange(min(scale.low, 1.0 / scale.high), max(scale.high, 1.0 / scale.low))
    found = {}
    for a in priors:
        for b in priors:
            if a is b:
                continue
            inverted = b.name == reference
            target, source = (b, a) if inverted else (a, b)
            found[a.name, b.name] = replace(
                Expected.of(target, source, settings),
                scale=scale,
                metre=ScaleRange.known() if target.name == reference else either,
                extent=(extents or {}).get(source.name, Extent()),
                inverted=inverted,
            )
    return found
