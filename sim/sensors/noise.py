"""Join the noise of all sensors, set by a level or by single components.

To add a term, add a field to ``RangeNoise`` (range_noise.py), ``OdometryNoise`` (odometry.py) or ``Adversity``
(adversity/settings.py): it is then a component by itself.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace

from sim.sensors.adversity.settings import Adversity
from sim.sensors.odometry import OdometryNoise
from sim.sensors.range_noise import RangeNoise

WORST_LEVEL = 20.0
"""Highest noise level; beyond it no map is recognizable."""


@dataclass(frozen=True)
class Noise:
    """Hold the noise of lidar and odometry, and the adversity. The defaults are level 1: a common small lidar on an
    ordinary robot, and no adversity."""

    lidar: RangeNoise = field(default_factory=RangeNoise)
    odometry: OdometryNoise = field(default_factory=OdometryNoise)
    adversity: Adversity = field(default_factory=Adversity)

    @staticmethod
    def level(level: float, lidar: RangeNoise | None = None) -> Noise:
        """Multiply all standard deviations and probabilities by ``level``: 0 is exact, 3 a bad robot.

        ``lidar`` is the lidar's noise at level 1 (default: a usual small lidar). Quantisation is not multiplied, but
        switched off at level 0. Adversity stays off. Raises ``ValueError`` if the level is negative, not a number, or
        above 20.
        """
        if not 0.0 <= level <= WORST_LEVEL:
            raise ValueError(f"noise is {level}, must lie between 0 and {WORST_LEVEL:g}")
        return Noise((lidar or RangeNoise()).scaled(level), OdometryNoise().scaled(level))

    def with_fields(self, values: Iterable[tuple[str, float]]) -> Noise:
        """Set single components by name, for example ``lidar.range_sigma`` or ``odometry.alpha1``.

        Raises ``ValueError`` with the component and its value if the component is unknown or the value is not allowed.
        """
        changed = self
        for name, value in values:
            if name not in COMPONENTS:
                raise ValueError(f"noise component {name!r} is unknown; known are {', '.join(COMPONENTS)}")
            part, _, component = name.partition(".")
            changed = replace(changed, **{part: replace(getattr(changed, part), **{component: value})})
        return changed


COMPONENTS = (
    *(f"lidar.{each.name}" for each in fields(RangeNoise)),
    *(f"odometry.{each.name}" for each in fields(OdometryNoise)),
    *(f"adversity.{each.name}" for each in fields(Adversity)),
)
"""Names of all noise components."""
