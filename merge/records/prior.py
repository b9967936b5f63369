"""Where a map is roughly known to lie before anything is matched."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry.se2 import wrap_angle
from mapping.geometry.similarity2 import Similarity2

SIGMA = 1.0
YAW_SIGMA = math.radians(10.0)
"""How far off the yaw of a prior may be, whatever its shift."""

WIDEST = 3.0
"""So many deviations off, an answer contradicts a prior."""

STEP_SHARE = 0.04
"""Starts of a search lie this share of the smaller map's diagonal apart: refinement reaches further."""

MOST_STARTS = 1500


@dataclass(frozen=True)
class Prior:
    """The pose of a map's frame in a frame that all priors share, and the deviation ``sigma`` [m] of its shift.

    Raises ``ValueError`` naming what is not finite or not positive.
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
    """Where a source should lie on a target, metres to metres, and the deviation of its shift [m]."""

    target_from_source: Similarity2
    sigma: float

    @staticmethod
    def of(target: Prior, source: Prior) -> Expected:
        return Expected(
            target.common_from_map.inverse() @ source.common_from_map, math.hypot(target.sigma, source.sigma)
        )

    def allows(self, found: Similarity2) -> bool:
        """Whether an answer lies within what is known beforehand: where it puts the origin of the source."""
        away = math.hypot(found.x - self.target_from_source.x, found.y - self.target_from_source.y)
        turned = abs(wrap_angle(found.yaw - self.target_from_source.yaw))
        return away <= WIDEST * self.sigma and turned <= WIDEST * YAW_SIGMA

    def starts(self, diagonal: float, target_metres: Similarity2, source_metres: Similarity2) -> list[Similarity2]:
        """Places around the expected one, cells to cells, close enough for one of them to be refined to the answer."""
        step = STEP_SHARE * diagonal * target_metres.scale
        number = max(0, math.ceil(2.0 * self.sigma / step))
        yaws = [k * YAW_SIGMA for k in range(-2, 3)]
        while (2 * number + 1) ** 2 * len(yaws) > MOST_STARTS:
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


def expected_places(priors: Sequence[Prior], reference: str | None) -> dict[tuple[str, str], Expected]:
    """What the priors say of each two maps, both ways round; the reference lies at the origin where it has none.

    Raises ``ValueError`` where a map has two, or one stands alone.
    """
    names = [prior.name for prior in priors]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"prior: {name} has more than one")
    if priors and reference is not None and reference not in names:
        priors = [*priors, Prior(reference, 0.0, 0.0, 0.0, 1e-3)]
    if len(priors) == 1:
        raise ValueError(f"prior: that of {priors[0].name} alone says nothing; give another map's, or the reference")
    return {(a.name, b.name): Expected.of(a, b) for a in priors for b in priors if a is not b}
