"""Describe one robot of a team."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from mapping.geometry.se2 import SE2
from sim.physics.drive import DriveLimits
from sim.sensors.lidar import Lidar

MAX_ROBOTS = 29
"""Most robots in one scene: each needs its own bit in a signed 32-bit mask, besides the bit of the walls."""


@dataclass(frozen=True)
class RobotSettings:
    """Describe a robot: its ``lidar``, the ``limits`` of its drive, its ``radius`` [m], and its ``start``,
    world_from_base. A start of None is chosen by the simulation.

    Raises ``ValueError`` with the field and its value.
    """

    lidar: Lidar = field(default_factory=Lidar)
    limits: DriveLimits = field(default_factory=DriveLimits)
    radius: float = 0.2
    start: SE2 | None = None

    def __post_init__(self) -> None:
        if not (math.isfinite(self.radius) and self.radius > 0.0):
            raise ValueError(f"RobotSettings: radius is {self.radius}, must be positive and finite")

    def scans(self, duration: float) -> int:
        """Return the number of scans within ``duration`` [s]: the first at 0 s, the last at or just before the end."""
        return math.floor(duration * self.lidar.rate + 1e-9) + 1
