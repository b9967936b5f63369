"""What the command line says of lidars and of single components of the noise."""

from __future__ import annotations

from collections.abc import Sequence

from mapquilt.numbers import parse_number
from sim.sensors.lidar import Lidar
from sim.sensors.lidar_presets import lidar_preset, with_rate
from sim.sensors.noise import Noise


def chosen_lidar(name: str, rate: float | None) -> Lidar:
    """The preset's lidar, with fewer sweeps a second where ``rate`` [Hz] says so.

    Raises ``ValueError`` where there is no such preset, or it does not sweep as often.
    """
    lidar = lidar_preset(name).lidar
    return lidar if rate is None else with_rate(lidar, rate)


def parse_components(options: Sequence[str]) -> tuple[tuple[str, float], ...]:
    """Options such as ``lidar.range_sigma=0.05`` as names and values.

    Raises ``ValueError`` naming the option where it is not of that form, its name unknown or its value bad.
    """
    return tuple(_parse_component(option) for option in options)


def _parse_component(option: str) -> tuple[str, float]:
    name, equals, text = option.partition("=")
    if not equals:
        raise ValueError(f"--set {option}: must be NAME=VALUE, such as lidar.range_sigma=0.05")
    try:
        value = parse_number(text)
    except ValueError:
        raise ValueError(f"--set {option}: {text!r} is no number") from None
    try:
        Noise().with_fields([(name, value)])
    except ValueError as error:
        raise ValueError(f"--set {option}: {error}") from None
    return name, value
