"""Settings of sensing: noise by level, and single components that differ from it."""

from __future__ import annotations

from dataclasses import dataclass

from sim.sensors.lidar_presets import lidar_preset
from sim.sensors.noise import Noise


@dataclass(frozen=True)
class SensingSettings:
    """Scale all noise by the level ``noise`` (0 exact, 1 a decent robot, 3 a bad one), and set single ``components`` by
    name whatever the level, as in ``("lidar.range_sigma", 0.05)``.

    Raises ``ValueError`` naming the field or component and its value.
    """

    noise: float = 1.0
    components: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        self.noise_of("default")

    def noise_of(self, lidar: str) -> Noise:
        """Return the noise of a robot that carries the lidar of that name."""
        return Noise.level(self.noise, lidar_preset(lidar).noise).with_fields(self.components)
