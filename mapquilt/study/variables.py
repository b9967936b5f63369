"""Variables of a study: any leaf of the settings, its axis title, and the sweeps that have a name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from mapquilt.leaves import split_assignment, with_leaf
from mapquilt.settings import COMBINED, ExperimentConfig

_UNITS = {
    "m": "resolution clear_range width height range_sigma bias_sigma quantum short_mean person_radius personal_space "
    "object_size opening_distance glass_depth pane_width ramp_radius lidar_height",
    "s": "duration person_pause change_time latency jitter",
    "Hz": "rate",
    "rad": "angle_sigma glass_angle ramp_slope slip_size",
    "rad/m": "veer_sigma",
    "m/s": "person_speed person_speed_sigma",
    "1/rad": "slip",
    "per 100 m^2": "people objects ramps",
    "degrees": "max_rotation",
    "stated m": "max_offset",
    "cells": "cells",
}
_TITLES = {
    "sensing.noise": "noise level",
    "sensing.lidar.level": "noise level of the lidar",
    "sensing.odometry.level": "noise level of the odometry",
    "sensing.adversity.level": "level of all adversities",
    "perturbation.scale": "range of true metres per stated metre",
    "perturbation.max_rotation": "greatest rotation of a map",
    "perturbation.max_offset": "greatest offset of a map",
    "mapping.resolution": "cell size",
    "mapping.clear_range": "range cleared by a beam without a return",
    "mission.robots": "robots in the team",
    "mission.duration": "mission time",
    "mission.beams": "beams of the lidar",
    "mission.overlap": "true overlap of the maps",
    "merge.scale": "searched scales",
}


@dataclass(frozen=True)
class Variable:
    """Name a setting by its dotted name."""

    name: str

    @property
    def title(self) -> str:
        """Describe the setting for an axis."""
        return _TITLES.get(self.name, self.name.split(".", 1)[-1].replace("_", " "))

    @property
    def unit(self) -> str:
        """Return the unit, empty if there is none."""
        last = self.name.rpartition(".")[2]
        return next((unit for unit, names in _UNITS.items() if last in names.split() or last.endswith(f"_{unit}")), "")

    @property
    def axis(self) -> str:
        """Return title and unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title

    def applied(self, config: ExperimentConfig, text: str) -> ExperimentConfig:
        """Return the settings with this value. Raises ``ValueError`` naming the setting and the text."""
        return with_leaf(config, self.name, text, COMBINED)


def parse_assignment(option: str, text: str) -> tuple[Variable, str]:
    """Parse ``NAME=VALUE`` into a variable and the text of its value. Raises ``ValueError`` naming the option."""
    name, value = split_assignment(ExperimentConfig(), option, text, COMBINED)
    return Variable(name), value


SWEEPS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "noise": ("sensing.noise", "0,0.5,1,1.5,2,3,4"),
        "lidar": ("sensing.lidar.range_sigma", "0,0.01,0.05,0.1,0.2"),
        "odometry": ("sensing.odometry.level", "0,0.5,1,1.5,2,3,4"),
        "adversity": ("sensing.adversity.level", "0,0.5,1,2,4"),
        "dropout": ("sensing.lidar.dropout", "0,0.05,0.1,0.2,0.4,0.8"),
        "overlap": ("mission.overlap", "0:0.15,0.15:0.3,0.3:0.45,0.45:0.6,0.6:0.8,0.8:1"),
        "scale": ("perturbation.scale", "1:1,0.9:1.11,0.8:1.25,0.67:1.5,0.5:2"),
        "rotation": ("perturbation.max_rotation", "0,15,45,90,180"),
        "resolution": ("mapping.resolution", "0.025,0.05,0.1,0.2"),
        "team": ("mission.robots", "2,3,4,6"),
        "beams": ("mission.beams", "45,90,180,360"),
        "time": ("mission.duration", "15,30,60,120,240"),
    }
)
"""The sweeps that have a name: the setting, and its values."""
