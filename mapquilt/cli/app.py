"""The command line: it parses, calls one function, prints, and turns errors into one line and an exit status."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from mapping.io.map_yaml import Mode
from mapquilt.benchmark.calibrate import calibrate
from mapquilt.benchmark.command import benchmark
from mapquilt.cli.entry import run_app
from mapquilt.cli.exit_status import ALL_MERGED, SOME_REFUSED
from mapquilt.cli.lidar_table import lidar_table
from mapquilt.cli.merge_options import (
    FusionOption,
    PriorOption,
    ReferenceOption,
    pair_executor,
    parse_priors,
)
from mapquilt.cli.mission_options import (
    GoalOption,
    MissionOptions,
    OverlapOption,
    ReplayOption,
    RobotsFile,
    StartOption,
    parse_mission,
)
from mapquilt.cli.place import open_place
from mapquilt.cli.scale_options import disguise_ranges, searched_scales
from mapquilt.cli.sensor_options import chosen_lidar, parse_components
from mapquilt.cli.tables import merge_table, print_table, score_table
from mapquilt.cli.worker_options import SchedulerOption, WorkersOption
from mapquilt.cli.worlds_command import Height, PlanResolution, Width, WorldName, worlds_app
from mapquilt.convert.command import Format
from mapquilt.convert.command import convert as convert_files
from mapquilt.dataset.command import app as dataset_app
from mapquilt.jobs.progress import count_progress, mission_progress
from mapquilt.merging.debug import METHOD, refuse_debug, show_steps
from mapquilt.merging.merge_again import answers_before
from mapquilt.merging.merge_file import merge_record
from mapquilt.merging.merge_folder import refuse_merge, write_merge
from mapquilt.merging.merge_inputs import MergeInputs, added_inputs, file_inputs, run_inputs
from mapquilt.report.command import report
from mapquilt.runs import folder as run_folder
from mapquilt.runs.coverage_file import coverage_line
from mapquilt.runs.overlap_report import overlap_told
from mapquilt.runs.sample import Poses, SampleSettings
from mapquilt.runs.stages import merge_run, run_seed, score_run, sense_run, simulate_run
from mapquilt.study.command import study
from merge.fusion import FUSIONS, FusionName
from merge.merger import merge_maps
from merge.methods import PROPOSERS, PUBLISHED
from merge.records.result import PairResult
from merge.settings import MergeSettings
from merge.verification.acceptance import MIN_CONFIDENCE, AcceptanceSettings
from sim.mission.settings import PolicyName
from sim.mission.starts import Starts
from sim.physics.drive import Drive, DriveLimits

app = typer.Typer(
    name="mapquilt",
    help="Simulate teams of robots that map a place, merge their occupancy grids, and score the merge against the "
    "truth.\n\nExit status: 0 all merged, 1 some map was refused, 2 bad input, 70 internal error, 130 interrupted, "
    "141 nobody read on.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

app.add_typer(worlds_app, name="worlds")


def path(text: str) -> Path:
    """The name of what is to be written. An empty one, as of a variable that is not set, would be the folder that one
    is in."""
    if not text:
        raise typer.BadParameter("it names nothing")
    return Path(text)


Out = Annotated[
    Path, typer.Option("--out", parser=path, help="Run folder to write; a run of mapquilt's there is replaced.")
]
RunFolder = Annotated[Path, typer.Argument(metavar="RUN", help="Run folder that `simulate` or `sense` wrote.")]
Noise = Annotated[float, typer.Option(help="Noise level: 0 exact, 1 a decent robot, 3 a bad one.")]
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
Unknown = Annotated[
    int | None, typer.Option(min=0, max=255, help="Grey level of map files that means unknown, whatever they say.")
]


@app.command()
def simulate(
    world: WorldName,
    out: Out,
    robots: Annotated[int | None, typer.Option(help="Number of robots; default: 3, or one for each start.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of world, starts, noise and disguise.")] = 6,
    duration: Annotated[float | None, typer.Option(help="Mission time [s]; default: 120, or a replay's.")] = None,
    starts: Annotated[Starts, typer.Option(help="Where robots begin that are given no start.")] = "random",
    start: StartOption = None,
    drive: Annotated[Drive, typer.Option(help="What robots move on.")] = "velocity",
    speed: Annotated[float, typer.Option(help="Greatest speed [m/s].")] = DriveLimits.speed,
    turn_rate: Annotated[float, typer.Option(help="Greatest turn rate [rad/s].")] = DriveLimits.turn_rate,
    policy: Annotated[PolicyName | None, typer.Option(help="What robots do; default: explore.")] = None,
    goal: GoalOption = None,
    replay: ReplayOption = None,
    robots_file: RobotsFile = None,
    overlap: OverlapOption = None,
    lidar: Annotated[str, typer.Option(help="Lidar that the robots carry; `mapquilt lidars` lists them.")] = "default",
    rate: Annotated[float | None, typer.Option(help="Sweeps a second [Hz]; default: the lidar's own.")] = None,
    noise: Noise = 1.0,
    components: SetOption = None,
    poses: PosesOption = "odometry",
    scale: ScaleOption = "hidden",
    max_rotation: MaxRotation = 180.0,
    max_offset: MaxOffset = 10.0,
    resolution: Resolution = 0.05,
    model: Model = "octomap",
    clear_range: ClearRange = 0.0,
    width: Width = None,
    height: Height = None,
    plan_resolution: PlanResolution = None,
) -> int:
    """Drive robots through a world; leave their maps, their logs and the truth."""
    place, warnings = open_place(world, seed, width, height, plan_resolution)
    _warn(warnings)
    carried = chosen_lidar(lidar, rate)
    mission, paths = parse_mission(
        MissionOptions(
            robots,
            duration,
            carried,
            starts,
            start or (),
            robots_file,
            drive,
            speed,
            turn_rate,
            policy,
            goal or (),
            replay or (),
            overlap,
        )
    )
    disguise = disguise_ranges(scale, max_rotation, max_offset)
    alone = parse_components(components or [])
    sample = SampleSettings(noise, poses, disguise, resolution, model, clear_range, seed, components=alone)
    with mission_progress(mission.duration) as (on_progress, on_mapping):
        made = simulate_run(out, place, mission, sample, seed, on_progress, paths, on_mapping)
    print_table(
        f"{out}: {_maps(len(mission.robots))} of {place.name}, seed {seed}, {mission.duration:g} s, noise {noise:g}"
    )
    print_table(coverage_line(out))
    if mission.overlap is not None:
        told = overlap_told(made, mission.overlap)
        print_table(told.line)
        _warn(told.warnings)
    return ALL_MERGED


@app.command()
def sense(
    run: RunFolder,
    out: Out,
    noise: Noise = 1.0,
    components: SetOption = None,
    seed: Annotated[int | None, typer.Option(help="Seed of noise and disguise; default: that of RUN.")] = None,
    poses: PosesOption = "odometry",
    scale: ScaleOption = "hidden",
    max_rotation: MaxRotation = 180.0,
    max_offset: MaxOffset = 10.0,
    resolution: Resolution = 0.05,
    model: Model = "octomap",
    clear_range: ClearRange = 0.0,
    parts: Annotated[int, typer.Option(help="Cut each robot's mission in time into so many parts: a map each.")] = 1,
) -> int:
    """Make another run of the same mission, at another noise level, without the simulator."""
    disguise = disguise_ranges(scale, max_rotation, max_offset)
    alone = parse_components(components or [])
    seed = run_seed(run) if seed is None else seed
    settings = SampleSettings(noise, poses, disguise, resolution, model, clear_range, seed, parts, alone)
    with count_progress("mapping") as on_mapping:
        mission = sense_run(run, out, settings, on_mapping)
    made = _maps(len(mission.robots) * parts)
    print_table(f"{out}: {made} of {mission.world.name} from {run}, noise {noise:g}")
    return ALL_MERGED


@app.command()
def merge(
    maps: Annotated[
        list[Path], typer.Argument(metavar="RUN | MAP...", help="A run folder, or maps: map_server YAML, PGM or PNG.")
    ],
    method: Annotated[str, typer.Option(help=f"Merging method: {', '.join(PROPOSERS)}.")] = "quilt",
    scale: Annotated[
        str, typer.Option(help="known, free (0.5 to 2), LO:HI, or auto: known if every resolution can be trusted.")
    ] = "auto",
    as_published: Annotated[
        bool,
        typer.Option(
            "--as-published",
            help=f"Take the method's own answer and verdict, not the common judge's: {', '.join(PUBLISHED)}.",
        ),
    ] = False,
    min_confidence: Annotated[
        float | None, typer.Option(help=f"Pairs that are less sure are refused. [default: {MIN_CONFIDENCE}]")
    ] = None,
    alternatives: Annotated[
        bool, typer.Option("--alternatives", help="List the best other places that were found for each pair, too.")
    ] = False,
    reference: ReferenceOption = None,
    fusion: FusionOption = "log_odds",
    prior: PriorOption = None,
    add: Annotated[
        list[Path] | None,
        typer.Option(
            "--add",
            metavar="MAP",
            help="Join this map to the merge that RUN (or the folder of an older --out) holds, without matching the "
            "others again; one that is called as a map there takes its place. Repeatable.",
        ),
    ] = None,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    seed: Annotated[int, typer.Option(help="Seed of the method's random samples.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option(parser=path, help="New folder, or one of an older merge, for the answer; a run gets it itself."),
    ] = None,
    debug: Annotated[
        Path | None,
        typer.Option(
            "--debug", metavar="DIR", parser=path, help="With --method morphology: folder for a picture of every step."
        ),
    ] = None,
    unknown: Unknown = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the record on standard output, and no more.")] = False,
) -> int:
    """Find the transforms between maps, and merge them into one for each group that they join to."""
    settings = MergeSettings(
        method,
        searched_scales(scale),
        as_published,
        _decision(min_confidence, as_published),
        reference,
        _fusion(fusion),
        parse_priors(prior or ()),
    )
    if debug is not None:
        refuse_debug(debug, settings, maps)
    inputs, folder, answers = _merge_inputs(maps, add or [], out, unknown, settings, seed)
    _warn(inputs.warnings)
    with (
        pair_executor(len(inputs.maps), workers, scheduler) as executor,
        count_progress("merging pairs") as on_progress,
    ):
        if folder is not None and run_folder.is_run(folder):
            result = merge_run(folder, settings, seed, on_progress, inputs, executor, answers)
        else:
            result = merge_maps(inputs.maps, settings, seed, on_progress, executor, answers)
            if folder is not None:
                write_merge(folder, inputs, settings, seed, result)
    if method == METHOD:
        _warn(show_steps(inputs.maps, settings, debug))
    if as_json:
        typer.echo(json.dumps(merge_record(inputs, settings, seed, result), allow_nan=False))
    else:
        print_table(merge_table(inputs.maps, result, alternatives))
    for name, reason in result.left_out.items():
        typer.echo(f"mapquilt: {name} was not merged: {reason}", err=True)
    return SOME_REFUSED if result.left_out else ALL_MERGED


def _merge_inputs(
    maps: list[Path], add: list[Path], out: Path | None, unknown: int | None, settings: MergeSettings, seed: int
) -> tuple[MergeInputs, Path | None, dict[tuple[str, str], PairResult]]:
    """What is merged, where the answer goes, and what is known of pairs."""
    if add:
        if len(maps) != 1 or not maps[0].is_dir():
            raise ValueError(f"--add {add[0]}: needs one folder to add to, a run's or that of an older merge")
        if out is not None:
            raise ValueError(f"--out {out}: with --add the answer goes where the merge is")
        inputs = added_inputs(maps[0], add, unknown)
        return inputs, maps[0], answers_before(maps[0], inputs.maps, settings, seed)
    if len(maps) == 1 and maps[0].is_dir():
        if out is not None:
            raise ValueError(f"--out {out}: a run gets its merged map in its own folder")
        if unknown is not None:
            raise ValueError("--unknown is for map files; a run says itself what is unknown")
        return run_inputs(maps[0]), maps[0], {}
    inputs = file_inputs(maps, unknown)
    if out is not None:
        refuse_merge(out, maps)
    return inputs, out, {}


def _fusion(name: str) -> FusionName:
    for known in FUSIONS:
        if name == known:
            return known
    raise ValueError(f"--fusion {name}: must be one of {', '.join(FUSIONS)}")


@app.command()
def score(run: RunFolder) -> int:
    """Compare a run's merge with the truth; write score.json and overview.png."""
    print_table(score_table(score_run(run_folder.require_run(run))))
    return ALL_MERGED


@app.command()
def convert(
    source: Annotated[
        Path, typer.Argument(metavar="MAP | LOG | RUN", help="A map file, a robot's log.npz, or a run folder.")
    ],
    out: Annotated[
        Path,
        typer.Argument(
            metavar="OUT", parser=path, help="File to write, replaced if there; for a run, a new or empty folder."
        ),
    ],
    to: Annotated[
        Format | None, typer.Option(help="Default: by OUT's ending, .yaml, .pgm, .png, .tum or .carmen.")
    ] = None,
    mode: Annotated[Mode | None, typer.Option(help="How a map's grey tells occupancy; default: trinary.")] = None,
    unknown: Unknown = None,
) -> int:
    """Write a map, a log or a run for other programs.

    A map becomes a map. A log becomes a TUM trajectory or a CARMEN log. A run becomes a folder: of TUM trajectories
    (odometry and truth), of CARMEN logs with the true poses, or a ROS 2 bag (needs `pip install mapquilt[ros]`).

    The bag holds scans, odometry, tf, maps and the true poses of each robot, but no transform from map to odom: the
    mapper that runs on it publishes that.
    """
    conversion = convert_files(source, out, to, mode, unknown)
    _warn(conversion.warnings)
    print_table(conversion.summary)
    return ALL_MERGED


@app.command()
def lidars() -> int:
    """List the lidars that robots can carry, their noise, and who says so."""
    print_table(lidar_table())
    return ALL_MERGED


def _decision(min_confidence: float | None, as_published: bool) -> AcceptanceSettings:
    if min_confidence is None:
        return AcceptanceSettings()
    if as_published:
        raise ValueError(f"--min-confidence {min_confidence:g}: with --as-published the method's own rule decides")
    return AcceptanceSettings(min_confidence=min_confidence)


def _maps(number: int) -> str:
    return f"{number} map" if number == 1 else f"{number} maps"


def _warn(warnings: tuple[str, ...]) -> None:
    for warning in warnings:
        typer.echo(f"mapquilt: warning: {warning}", err=True)


app.add_typer(dataset_app, name="dataset")
app.command()(benchmark)
app.command()(calibrate)
app.command()(study)
app.command()(report)


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"mapquilt {version('mapquilt')}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    pass


def run(arguments: list[str]) -> int:
    """Run one command and return its exit status. Errors end here, in one line on standard error."""
    return run_app(app, arguments, "mapquilt")
