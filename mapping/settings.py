"""Settings of mapping: from a robot's log to its grid."""

from __future__ import annotations

from dataclasses import dataclass, field

from mapping.grid.sensor_model import sensor_model
from mapping.slam.settings import POSES, SlamSettings


@dataclass(frozen=True)
class MappingSettings:
    """Choose how a log becomes a grid.

    - ``poses``: the front end whose poses the robot maps with (``mapping.slam.front_end``), or ``truth``;
    - ``resolution`` [m]: cell size;
    - ``sensor_model``: name of the inverse sensor model;
    - ``clear_range`` [m]: range cleared along a beam that has no return; 0 clears none;
    - ``slam``: settings of the front end ``slam``.

    Raises ``ValueError`` naming the field and the value.
    """

    poses: str = "slam"
    resolution: float = 0.05
    sensor_model: str = "octomap"
    clear_range: float = 0.0
    slam: SlamSettings = field(default_factory=SlamSettings)

    def __post_init__(self) -> None:
        sensor_model(self.sensor_model)
        if self.poses not in POSES:
            raise ValueError(f"poses is {self.poses!r}, must be one of {', '.join(POSES)}")
        if not 0.005 <= self.resolution <= 10.0:
            raise ValueError(f"resolution is {self.resolution}, must lie between 0.005 and 10 m")
        if not 0.0 <= self.clear_range <= 1000.0:
            raise ValueError(f"clear_range is {self.clear_range}, must lie between 0 and 1000 m")
