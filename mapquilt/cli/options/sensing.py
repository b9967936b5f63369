"""Options of lidars, noise, mapping and frame perturbation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

import typer

from mapping.grid.frame_perturbation import FramePerturbationRanges
from mapping.settings import Poses
from mapquilt.numbers import parse_number, parse_range
from sim.sensors.lidar import Lidar
from sim.sensors.lidar_presets import lidar_preset, with_rate
from sim.sensors.noise import Noise

NoiseOption = Annotated[float, typer.Option(help="Noise level: 0 exact, 1 a decent robot, 3 a bad one.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="One component of the noise, whatever the level: lidar.range_sigma=0.05. Repeatable.",
    ),
]
PosesOption = Annotated[Poses, typer.Option(help="Poses that the robots map with.")]
ScaleOption = Annotated[
    str, typer.Option(help="How wrong resolutions are stated: hidden (by 0.5 to 2), honest (not at all), or LO:HI.")
]
MaxRotation = Annotated[float, typer.Option(help="Maps are turned by up to this, either way [degrees].")]
MaxOffset = Annotated[float, typer.Option(help="Maps are shifted by up to this in x and y [stated m].")]
Resolution = Annotated[float, typer.Option(help="Cell size of the robots' grids [m].")]
Model = Annotated[str, typer.Option(help="Inverse sensor model: octomap, hector, cartographer, counting, karto.")]
ClearRange = Annotated[float, typer.Option(help="How far a beam without a return clears [m]; 0 clears nothing.")]

_PERTURBED_SCALES = {"hidden": (0.5, 2.0), "honest": (1.0, 1.0)}


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


def disguise_ranges(scale: str, max_rotation_deg: float, max_offset: float) -> FramePerturbationRanges:
    """What disguises are drawn from; ``scale`` is hidden (0.5 to 2), honest (1) or LO:HI.

    Raises ``ValueError`` naming the setting and the value.
    """
    try:
        bounds = _PERTURBED_SCALES[scale] if scale in _PERTURBED_SCALES else parse_range(scale)
    except ValueError:
        raise ValueError(f"scale is {scale}, must be hidden, honest or LO:HI such as 0.8:1.25") from None
    if not 0.0 <= max_rotation_deg <= 180.0:
        raise ValueError(f"max_rotation is {max_rotation_deg:g}, must lie between 0 and 180 degrees")
    return FramePerturbationRanges(*bounds, math.radians(max_rotation_deg), max_offset)
