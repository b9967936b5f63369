"""Settings of mapping: from a robot's log to its grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from mapping.grid.sensor_model import sensor_model

Poses = Literal["odometry", "truth"]
"""odometry: the poses that the wheels measure; truth: the true ones."""


@dataclass(frozen=True)
class MappingSettings:
    """Choose the ``poses`` that robots map with, the cell size ``resolution`` [m], the inverse ``sensor_model`` by
    name, and ``clear_range`` [m]: how far a beam without a return clears the map.

    Raises ``ValueError`` naming the field and the value.
    """

    poses: Poses = "odometry"
    resolution: float = 0.05
    sensor_model: str = "octomap"
    clear_range: float = 0.0

    def __post_init__(self) -> None:
        sensor_model(self.sensor_model)
        if self.poses not in get_args(Poses):
            raise ValueError(f"poses is {self.poses!r}, must be one of {', '.join(get_args(Poses))}")
        if not 0.005 <= self.resolution <= 10.0:
            raise ValueError(f"resolution is {self.resolution}, must lie between 0.005 and 10 m")
        if not 0.0 <= self.clear_range <= 1000.0:
            raise ValueError(f"clear_range is {self.clear_range}, must lie between 0 and 1000 m")
