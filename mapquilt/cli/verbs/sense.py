"""``mapquilt sense``: map a stored mission again."""

from __future__ import annotations

from typing import Annotated

import typer

from mapping.settings import LOG_ODDS
from mapping.wording import counted
from mapquilt.cli.exit_status import ALL_MERGED
from mapquilt.cli.options.files import Out, RunFolder
from mapquilt.cli.options.sensing import (
    ClearRange,
    MapperOption,
    MaxOffset,
    MaxRotation,
    Model,
    NoiseOption,
    PosesOption,
    Resolution,
    ScaleOption,
    SetOption,
    sample_settings,
)
from mapquilt.cli.tables import print_table
from mapquilt.jobs.progress import count_progress, mapping_label
from mapquilt.runs.stages import run_seed, sense_run


def sense(
    run: RunFolder,
    out: Out,
    noise: NoiseOption = 1.0,
    components: SetOption = None,
    seed: Annotated[int | None, typer.Option(help="Seed of noise and map frames; default: that of RUN.")] = None,
    mapper: MapperOption = LOG_ODDS,
    poses: PosesOption = None,
    scale: ScaleOption = "hidden",
    max_rotation: MaxRotation = 180.0,
    max_offset: MaxOffset = 10.0,
    resolution: Resolution = 0.05,
    model: Model = "octomap",
    clear_range: ClearRange = 0.0,
    parts: Annotated[int, typer.Option(help="Number of maps per robot: its mission is cut in time.")] = 1,
) -> int:
    """Make another run of the same mission, with other noise, without the simulator.

    Example: mapquilt sense runs/office --noise 2 --out runs/office-2
    """
    settings = sample_settings(
        noise=noise,
        mapper=mapper,
        poses=poses,
        resolution=resolution,
        model=model,
        clear_range=clear_range,
        scale=scale,
        max_rotation=max_rotation,
        max_offset=max_offset,
        parts=parts,
        changes=components or (),
        seed=run_seed(run) if seed is None else seed,
    )
    with count_progress(mapping_label()) as on_mapping:
        mission = sense_run(run, out, settings, on_mapping)
    made = counted(len(mission.robots) * parts, "map")
    print_table(f"{out}: {made} of {mission.world.name} from {run}, noise {noise:g}")
    return ALL_MERGED
