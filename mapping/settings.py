"""Settings of mapping: from a robot's log to its grid."""

from __future__ import annotations

from dataclasses import dataclass, field

from mapping.grid.sensor_model import COUNTING, sensor_model
from mapping.particle.settings import ParticleSettings
from mapping.slam.settings import POSES, SlamSettings

LOG_ODDS, PARTICLE = "log-odds", "particle"
MAPPERS = (LOG_ODDS, PARTICLE)
"""Values of ``mapping.mapper``."""


@dataclass(frozen=True)
class MappingSettings:
    """Choose how a log becomes a grid.

    - ``poses``: the front end whose poses the robot maps with (``mapping.slam.front_end``), or ``truth``;
    - ``resolution`` [m]: cell size;
    - ``sensor_model``: name of the inverse sensor model;
    - ``clear_range`` [m]: range cleared along a beam that has no return; 0 clears none;
    - ``slam``: settings of the front end ``slam``;
    - ``mapper``: ``log-odds`` draws all scans at the poses of the front end; ``particle`` estimates the poses and the
      grid together, by a particle filter with counting grids, so that ``poses`` and ``sensor_model`` must keep their
      defaults, which it does not use;
    - ``particle``: settings of the particle filter.

    Raises ``ValueError`` naming the field and the value.
    """

    poses: str = "slam"
    resolution: float = 0.05
    sensor_model: str = "octomap"
    clear_range: float = 0.0
    slam: SlamSettings = field(default_factory=SlamSettings)
    mapper: str = LOG_ODDS
    particle: ParticleSettings = field(default_factory=ParticleSettings)

    def __post_init__(self) -> None:
        sensor_model(self.sensor_model)
        if self.poses not in POSES:
            raise ValueError(f"poses is {self.poses!r}, must be one of {', '.join(POSES)}")
        if not 0.005 <= self.resolution <= 10.0:
            raise ValueError(f"resolution is {self.resolution}, must lie between 0.005 and 10 m")
        if not 0.0 <= self.clear_range <= 1000.0:
            raise ValueError(f"clear_range is {self.clear_range}, must lie between 0 and 1000 m")
        if self.mapper not in MAPPERS:
            raise ValueError(f"mapper is {self.mapper!r}, must be one of {', '.join(MAPPERS)}")
        if self.mapper == PARTICLE and self.poses != MappingSettings.poses:
            raise ValueError(f"poses is {self.poses!r}, but mapper {PARTICLE} estimates its own; leave poses out")
        if self.mapper == PARTICLE and self.sensor_model != MappingSettings.sensor_model:
            raise ValueError(
                f"sensor_model is {self.sensor_model!r}, but mapper {PARTICLE} counts hits; leave sensor_model out"
            )

    @property
    def pose_source(self) -> str:
        """The name of what gave the poses, for records: ``poses``, or ``particle``."""
        return PARTICLE if self.mapper == PARTICLE else self.poses

    @property
    def cell_model(self) -> str:
        """The name of the sensor model that the cells follow, for records."""
        return COUNTING.name if self.mapper == PARTICLE else self.sensor_model
