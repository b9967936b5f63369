"""``mapquilt simulate``: simulate robots and build their maps."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mapping.settings import LOG_ODDS
from mapping.wording import counted
from mapquilt.cli.exit_status import ALL_MERGED, NOT_REACHED
from mapquilt.cli.options.files import Out
from mapquilt.cli.options.mission import (
    SEED,
    GoalOption,
    MissionOptions,
    OverlapOption,
    ReplayOption,
    RobotsFile,
    StartOption,
    parse_mission,
)
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
from mapquilt.cli.options.world import FromMap, Height, Level, PlanResolution, Width, WorldName
from mapquilt.cli.tables import print_table, warn
from mapquilt.jobs.progress import mission_progress
from mapquilt.runs.coverage_file import coverage_line
from mapquilt.runs.folder import spare_inputs
from mapquilt.runs.open_world import open_world
from mapquilt.runs.sample import Sample
from mapquilt.runs.stages import simulate_run
from mapquilt.settings import lidar_at_rate
from sim.mission.settings import PolicyName, Starts
from sim.physics.drive import Drive, DriveLimits
from worlds.importing.plan_file import PlanOptions


def simulate(
    world: WorldName,
    out: Out,
    robots: Annotated[int | None, typer.Option(help="Number of robots; default: 3, or one per start.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of world, starts, noise and map frames.")] = SEED,
    duration: Annotated[float | None, typer.Option(help="Mission duration [s]; default: 120, or the replay's.")] = None,
    starts: Annotated[Starts, typer.Option(help="Placement of the robots without --start.")] = "random",
    start: StartOption = None,
    drive: Annotated[Drive, typer.Option(help="Drive model: an ideal velocity, or wheels that slip.")] = "velocity",
    speed: Annotated[float, typer.Option(help="Maximum speed [m/s].")] = DriveLimits.speed,
    turn_rate: Annotated[float, typer.Option(help="Maximum turn rate [rad/s].")] = DriveLimits.turn_rate,
    policy: Annotated[PolicyName | None, typer.Option(help="Policy of the robots; default: explore.")] = None,
    goal: GoalOption = None,
    replay: ReplayOption = None,
    robots_file: RobotsFile = None,
    overlap: OverlapOption = None,
    lidar: Annotated[str, typer.Option(help="Lidar that the robots carry; `mapquilt lidars` lists them.")] = "default",
    rate: Annotated[float | None, typer.Option(help="Scan rate [Hz]; default: the lidar's own.")] = None,
    noise: NoiseOption = 1.0,
    components: SetOption = None,
    mapper: MapperOption = LOG_ODDS,
    poses: PosesOption = None,
    scale: ScaleOption = "hidden",
    max_rotation: MaxRotation = 180.0,
    max_offset: MaxOffset = 10.0,
    resolution: Resolution = 0.05,
    model: Model = "octomap",
    clear_range: ClearRange = 0.0,
    width: Width = None,
    height: Height = None,
    plan_resolution: PlanResolution = None,
    level: Level = None,
    from_map: FromMap = False,
) -> int:
    """Simulate robots in a world; write their maps, their logs and the truth.

    Exit status 3 if --overlap was not reached; the nearest result is written.

    Example: mapquilt simulate office --robots 3 --out runs/office
    """
    spare_inputs(out, [Path(world), *(replay or ()), *([] if robots_file is None else [robots_file])])
    opened, warnings = open_world(world, seed, width, height, PlanOptions(plan_resolution, level, from_map))
    warn(warnings)
    mission, paths = parse_mission(
        MissionOptions(
            robots=robots,
            duration=duration,
            lidar=lidar_at_rate(lidar, rate),
            starts=starts,
            start=start or (),
            robots_file=robots_file,
            drive=drive,
            speed=speed,
            turn_rate=turn_rate,
            policy=policy,
            goal=goal or (),
            replay=replay or (),
            overlap=overlap,
        )
    )
    sample = sample_settings(
        noise=noise,
        mapper=mapper,
        poses=poses,
        resolution=resolution,
        model=model,
        clear_range=clear_range,
        scale=scale,
        max_rotation=max_rotation,
        max_offset=max_offset,
        parts=1,
        changes=components or (),
        seed=seed,
    )
    with mission_progress(mission.duration) as (on_progress, on_mapping):
        made = simulate_run(out, opened, mission, sample, seed, on_progress, paths, on_mapping)
    print_table(
        f"{out}: {counted(len(mission.robots), 'map')} of {opened.name}, seed {seed}, "
        f"{mission.duration:g} s, noise {sample.sensing.noise:g}"
    )
    print_table(coverage_line(out))
    if mission.overlap is not None and not _report_overlaps(made, mission.overlap):
        return NOT_REACHED
    return ALL_MERGED


def _report_overlaps(sample: Sample, requested: tuple[float, float]) -> bool:
    """Print the range of true overlaps, and a warning for each pair outside the requested range; return if there is
    none."""
    low, high = requested
    overlaps = sample.true_overlaps()
    seconds = [place.truth.trajectory.stamps[-1] for place in sample.places.maps]
    print_table(
        f"true overlap {min(overlaps.values()):.3f} to {max(overlaps.values()):.3f}, requested {low:g} to {high:g}; "
        f"missions cut to {', '.join(f'{end:.0f}' for end in seconds)} s"
    )
    missed = tuple(
        f"overlap {low:g}:{high:g} was not reached: {a} and {b} overlap by {overlap:.3f}, the nearest found; "
        "try another --starts, --seed or --duration"
        for (a, b), overlap in overlaps.items()
        if not low <= overlap <= high
    )
    warn(missed)
    return not missed
