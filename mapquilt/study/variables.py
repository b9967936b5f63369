"""The settings that a study can vary, by name, and how people write their values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from types import MappingProxyType
from typing import Any

from mapquilt.numbers import parse_number, parse_range
from mapquilt.study.setup import ExperimentConfig
from sim.sensors.noise import COMPONENTS
from sim.sensors.odometry import OdometryNoise
from sim.sensors.range_noise import RangeNoise

Change = Callable[[ExperimentConfig, str], ExperimentConfig]


@dataclass(frozen=True)
class Variable:
    """A setting: what it is, in words for an axis, its unit ("" where it has none), and how a text changes it."""

    name: str
    title: str
    unit: str
    change: Change

    @property
    def axis(self) -> str:
        return f"{self.title} [{self.unit}]" if self.unit else self.title

    def applied(self, setup: ExperimentConfig, text: str) -> ExperimentConfig:
        """The setup with this value. Raises ``ValueError`` naming the setting and the text."""
        try:
            return self.change(setup, text)
        except ValueError as error:
            raise ValueError(f"{self.name}={text}: {error}") from None


def variable(name: str) -> Variable:
    """The setting of that name. Raises ``ValueError`` naming all of them where there is none."""
    if name not in VARIABLES:
        raise ValueError(f"{name} is no setting; known are {', '.join(VARIABLES)}")
    return VARIABLES[name]


def parse_assignment(option: str, text: str) -> tuple[Variable, str]:
    """``NAME=VALUE`` as a setting and what follows. Raises ``ValueError`` naming the option."""
    name, equals, value = text.partition("=")
    if not equals or not value:
        raise ValueError(f"{option} {text}: must be NAME=VALUE, such as noise=1")
    try:
        return variable(name), value
    except ValueError as error:
        raise ValueError(f"{option} {text}: {error}") from None


def _field(name: str, parse: Callable[[str], Any], setup: ExperimentConfig, text: str) -> ExperimentConfig:
    return replace(setup, **{name: parse(text)})


def _component(name: str, setup: ExperimentConfig, text: str) -> ExperimentConfig:
    kept = tuple(one for one in setup.components if one[0] != name)
    return replace(setup, components=(*kept, (name, parse_number(text))))


def _level(part: str, defaults: RangeNoise | OdometryNoise, setup: ExperimentConfig, text: str) -> ExperimentConfig:
    """All components of the lidar, or of the odometry, at a level of their own."""
    scaled = defaults.scaled(parse_number(text))
    kept = tuple(one for one in setup.components if not one[0].startswith(f"{part}."))
    return replace(setup, components=(*kept, *((f"{part}.{f.name}", getattr(scaled, f.name)) for f in fields(scaled))))


def _whole(text: str) -> int:
    number = parse_number(text)
    if number != int(number):
        raise ValueError(f"{text!r} is no whole number")
    return int(number)


def _variable(name: str, title: str, unit: str, parse: Callable[[str], Any] = parse_number) -> Variable:
    return Variable(name, title, unit, partial(_field, name, parse))


_SETTINGS = (
    _variable("noise", "noise level", ""),
    Variable("lidar.level", "noise level of the lidar", "", partial(_level, "lidar", RangeNoise())),
    Variable("odometry.level", "noise level of the odometry", "", partial(_level, "odometry", OdometryNoise())),
    _variable("poses", "poses mapped with", "", str),
    _variable("scale", "true metres per stated metre, drawn from", "", str),
    _variable("max_rotation", "greatest rotation of a map", "degrees"),
    _variable("max_offset", "greatest shift of a map", "stated m"),
    _variable("resolution", "cell size", "m"),
    _variable("model", "inverse sensor model", "", str),
    _variable("clear_range", "how far a beam without a return clears", "m"),
    _variable("parts", "parts a mission is cut into", "", _whole),
    _variable("world", "world", "", str),
    _variable("width", "width of the world", "m"),
    _variable("height", "height of the world", "m"),
    _variable("robots", "robots in the team", "", _whole),
    _variable("duration", "mission time", "s"),
    _variable("lidar", "lidar", "", str),
    _variable("rate", "sweeps of the lidar", "Hz"),
    _variable("beams", "beams of the lidar", "", _whole),
    _variable("starts", "where robots begin", "", str),
    _variable("drive", "what robots move on", "", str),
    _variable("policy", "what robots do", "", str),
    _variable("overlap", "true overlap of the maps", "", parse_range),
    _variable("search", "scales that are searched", "", str),
    _variable("min_confidence", "confidence that is asked for", ""),
)
_UNITS = {"range_sigma": "m", "bias_sigma": "m", "angle_sigma": "rad", "quantum": "m", "short_mean": "m"} | {
    "veer_sigma": "rad/m"
}

VARIABLES: Mapping[str, Variable] = MappingProxyType(
    {one.name: one for one in _SETTINGS}
    | {
        name: Variable(name, name, _UNITS.get(name.partition(".")[2], ""), partial(_component, name))
        for name in COMPONENTS
    }
)
"""Every setting, by name."""

SWEEPS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "noise": ("noise", "0,0.5,1,1.5,2,3,4"),
        "lidar": ("lidar.range_sigma", "0,0.01,0.05,0.1,0.2"),
        "odometry": ("odometry.level", "0,0.5,1,1.5,2,3,4"),
        "dropout": ("lidar.dropout", "0,0.05,0.1,0.2,0.4,0.8"),
        "overlap": ("overlap", "0:0.15,0.15:0.3,0.3:0.45,0.45:0.6,0.6:0.8,0.8:1"),
        "scale": ("scale", "1:1,0.9:1.11,0.8:1.25,0.67:1.5,0.5:2"),
        "rotation": ("max_rotation", "0,15,45,90,180"),
        "resolution": ("resolution", "0.025,0.05,0.1,0.2"),
        "team": ("robots", "2,3,4,6"),
        "beams": ("beams", "45,90,180,360"),
        "time": ("duration", "15,30,60,120,240"),
    }
)
"""The sweeps that have a name: what they vary, and through which values."""
