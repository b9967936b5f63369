"""Priors: start poses of maps that are roughly known before the merge."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry.se2 import wrap_angle
from mapping.geometry.similarity2 import Similarity2
from mapping.validation import require_valid

SIGMA = 1.0
"""Standard deviation [m] of a start pose for which none is given."""


@dataclass(frozen=True)
class PriorSettings:
    """Use of start poses.

    - ``yaw_sigma`` [rad]: standard deviation of the yaw of a start pose;
    - ``max_deviations``: an answer further away than so many standard deviations contradicts the prior;
    - ``step_share`` [of the smaller map's diagonal]: distance of the starts of a search; refinement reaches further;
    - ``max_starts``: a search has no more starts.
    """

    yaw_sigma: float = math.radians(10.0)
    max_deviations: float = 3.0
    step_share: float = 0.04
    max_starts: int = 1500

    def __post_init__(self) -> None:
        require_valid(self)


@dataclass(frozen=True)
class Prior:
    """Start pose of a map in a frame that all priors share; ``sigma`` [m] is the standard deviation of its shift.

    Raises ``ValueError`` that names a value that is not finite or not positive.
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

    @property
    def common_from_map(self) -> Similarity2:
        return Similarity2(self.x, self.y, self.yaw)


@dataclass(frozen=True)
class Expected:
    """Expected pose of a source on a target, metres to metres, and the standard deviation of its shift [m]."""

    target_from_source: Similarity2
    sigma: float
    settings: PriorSettings = PriorSettings()

    @staticmethod
    def of(target: Prior, source: Prior, settings: PriorSettings = PriorSettings()) -> Expected:
        relative = target.common_from_map.inverse() @ source.common_from_map
        return Expected(relative, math.hypot(target.sigma, source.sigma), settings)

    def allows(self, found: Similarity2) -> bool:
        """Test if an answer agrees with the prior: by the position of the source's origin, and by its yaw."""
        most = self.settings.max_deviations
        shift = math.hypot(found.x - self.target_from_source.x, found.y - self.target_from_source.y)
        turn = abs(wrap_angle(found.yaw - self.target_from_source.yaw))
        return shift <= most * self.sigma and turn <= most * self.settings.yaw_sigma

    def starts(self, diagonal: float, target_metres: Similarity2, source_metres: Similarity2) -> list[Similarity2]:
        """List transforms around the expected one, cells to cells, so dense that refinement finds the answer.

        ``diagonal`` is that of the target [cells]; the others go from cells to metres.
        """
        step = self.settings.step_share * diagonal * target_metres.scale
        number = max(0, math.ceil(2.0 * self.sigma / step))
        yaws = [k * self.settings.yaw_sigma for k in range(-2, 3)]
        while (2 * number + 1) ** 2 * len(yaws) > self.settings.max_starts:
            number -= 1
        shifts = np.linspace(-2.0 * self.sigma, 2.0 * self.sigma, 2 * number + 1) if number else np.zeros(1)
        expected = self.target_from_source
        return [
            target_metres.inverse()
            @ Similarity2(expected.x + dx, expected.y + dy, expected.yaw + turn, expected.scale)
            @ source_metres
            for turn in yaws
            for dx in shifts.tolist()
            for dy in shifts.tolist()
        ]


def expected_poses(
    priors: Sequence[Prior], reference: str | None, settings: PriorSettings = PriorSettings()
) -> dict[tuple[str, str], Expected]:
    """Return the expected pose of each two maps with priors, both ways; a reference without one lies at the origin.

    Raises ``ValueError`` if a map has two priors, or only one map has one.
    """
    names = [prior.name for prior in priors]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"prior: {name} has more than one")
    if priors and reference is not None and reference not in names:
        priors = [*priors, Prior(reference, 0.0, 0.0, 0.0, 1e-3)]
    if len(priors) == 1:
        raise ValueError(f"prior: that of {priors[0].name} alone says nothing; give another map's, or the reference")
    return {(a.name, b.name): Expected.of(a, b, settings) for a in priors for b in priors if a is not b}
