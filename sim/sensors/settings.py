"""Set the noise level, and single components that differ from it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from sim.sensors.adversity.settings import Adversity
from sim.sensors.lidar_presets import lidar_preset
from sim.sensors.noise import COMPONENTS, Noise


@dataclass(frozen=True)
class SensingSettings:
    """Scale all noise by the level ``noise`` (0 exact, 1 an ordinary robot, 3 a bad one), and set single ``components``
    by name at any level, for example ``("lidar.range_sigma", 0.05)``.

    Raises ``ValueError`` with the field or component and its value.
    """

    noise: float = 1.0
    components: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        self.noise_of("default")

    def noise_of(self, lidar: str) -> Noise:
        """Return the noise of a robot that carries the lidar of that name."""
        return Noise.level(self.noise, lidar_preset(lidar).noise).with_fields(self.components)

    @property
    def adversity(self) -> Adversity:
        """Return the adversity, which is the same for all robots."""
        return self.noise_of("default").adversity

    def component_names(self) -> tuple[str, ...]:
        """List the names of all components."""
        return COMPONENTS

    def component(self, name: str) -> float | None:
        """Return the value of a component, None if the level decides."""
        return dict(self.components).get(name)

    def with_component(self, name: str, value: float) -> SensingSettings:
        """Set one component. Raises ``ValueError`` naming it and its value."""
        kept = tuple(one for one in self.components if one[0] != name)
        return replace(self, components=(*kept, (name, value)))
