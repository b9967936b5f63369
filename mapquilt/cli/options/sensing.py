"""Options of lidars, noise, mapping and frame perturbation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from mapping.grid.frame_perturbation import FramePerturbationRanges
from mapping.settings import LOG_ODDS, MAPPERS, PARTICLE, MappingSettings
from mapping.slam.settings import POSES
from mapquilt.leaves import split_assignment, with_assignments
from mapquilt.settings import COMBINED, ExperimentConfig, SampleSettings, max_yaw_of, parse_perturbed_scales
from sim.sensors.settings import SensingSettings

SET_HERE = ("sensing", "mapping", "perturbation", "parts")

NoiseOption = Annotated[float, typer.Option(help="Noise level: 0 exact, 1 an ordinary robot, 3 a bad one.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Any setting of sensing, mapping or perturbation by its dotted name: lidar.range_sigma=0.05, "
        "adversity.level=1. Repeatable.",
    ),
]
MapperOption = Annotated[
    str, typer.Option(help=f"Mapper: {', '.join(MAPPERS)}. {PARTICLE} estimates the poses itself (gmapping).")
]
PosesOption = Annotated[
    str | None,
    typer.Option(help=f"Poses to map with: {', '.join(POSES)}; default with {LOG_ODDS}: {MappingSettings.poses}."),
]
ScaleOption = Annotated[
    str, typer.Option(help="Scale error of the stated resolution: hidden (0.5 to 2), honest (none), or LO:HI.")
]
MaxRotation = Annotated[float, typer.Option(help="Map frames are turned by up to this, either way [degrees].")]
MaxOffset = Annotated[float, typer.Option(help="Map frames are shifted by up to this in x and y [stated m].")]
Resolution = Annotated[float, typer.Option(help="Cell size of the robots' grids [m].")]
Model = Annotated[
    str, typer.Option(help="Inverse sensor model: octomap, hector, cartographer, counting (or gmapping), karto.")
]
ClearRange = Annotated[float, typer.Option(help="Length of free space to mark along a beam without a return [m].")]


def sample_settings(
    *,
    noise: float,
    mapper: str,
    poses: str | None,
    resolution: float,
    model: str,
    clear_range: float,
    scale: str,
    max_rotation: float,
    max_offset: float,
    parts: int,
    changes: Sequence[str],
    seed: int,
) -> SampleSettings:
    """Combine the options, and then the changes by ``--set``. Raises ``ValueError`` naming the option and the value."""
    require_settings_of(SET_HERE, changes)
    config = ExperimentConfig(
        sensing=SensingSettings(noise),
        mapping=MappingSettings(poses or MappingSettings.poses, resolution, model, clear_range, mapper=mapper),
        perturbation=FramePerturbationRanges(*parse_perturbed_scales(scale), max_yaw_of(max_rotation), max_offset),
        parts=parts,
    )
    sample = with_assignments(config, "--set", changes, COMBINED).sample(seed)
    require_no_poses(sample.mapping, poses)
    return sample


def require_settings_of(steps: Sequence[str], changes: Sequence[str]) -> None:
    """Raise ``ValueError`` naming the first ``--set`` whose setting belongs to none of the steps."""
    for text in changes:
        name, _ = split_assignment(ExperimentConfig(), "--set", text, COMBINED)
        if name.partition(".")[0] not in steps:
            raise ValueError(f"--set {text}: must name a setting of {', '.join(steps)}")


def require_no_poses(mapping: MappingSettings, poses: str | None) -> None:
    """Raise ``ValueError`` if ``--poses`` was given although the mapper estimates the poses itself."""
    if mapping.mapper == PARTICLE and poses is not None:
        raise ValueError(f"--poses {poses}: must be left out with mapper {PARTICLE}, which estimates the poses itself")
