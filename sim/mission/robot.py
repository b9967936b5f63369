"""What one robot of a team is."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from mapping.geometry.se2 import SE2
from sim.physics.drive import DriveLimits
from sim.sensors.lidar import Lidar


@dataclass(frozen=True)
class RobotSettings:
    """The ``lidar`` that a robot carries, the ``limits`` of its drive, its ``radius`` [m], and ``start``, the
    world_from_base that it begins at; without one, a start is chosen.

    Raises ``ValueError`` naming the field and its value.
    """

    lidar: Lidar = field(default_factory=Lidar)
    limits: DriveLimits = field(default_factory=DriveLimits)
    radius: float = 0.2
    start: SE2 | None = None

    def __post_init__(self) -> None:
        if not (math.isfinite(self.radius) and self.radius > 0.0):
            raise ValueError(f"RobotSettings: radius is {self.radius}, must be positive and finite")

    def scans(self, duration: float) -> int:
        """How many scans it takes in that time [s]: the first at 0 s, the last at or just before the end."""
        return math.floor(duration * self.lidar.rate + 1e-9) + 1
