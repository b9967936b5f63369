"""``mapquilt map``: draw the maps of real logs."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from mapping.settings import LOG_ODDS, MappingSettings
from mapping.slam.settings import TRUE_POSES
from mapquilt.cli.exit_status import ALL_MERGED
from mapquilt.cli.options.files import path
from mapquilt.cli.options.sensing import (
    ClearRange,
    MapperOption,
    Model,
    Resolution,
    require_no_poses,
    require_settings_of,
)
from mapquilt.cli.tables import print_table, warn
from mapquilt.evaluation.trajectory_error import Spread
from mapquilt.jobs.progress import count_progress, mapping_label
from mapquilt.leaves import with_assignments
from mapquilt.logs.load_log import LogSource, NamedLog, load_log
from mapquilt.logs.log_map import LOG_POSES, REFERENCE, LogMap, cut_logs, draw_logs
from mapquilt.logs.map_folder import refuse_map_folder, write_log_map, write_log_run
from mapquilt.logs.reference_truth import reference_steps
from mapquilt.runs.folder import spare_inputs
from mapquilt.settings import COMBINED, ExperimentConfig
from mapquilt.viz.text_table import plain_table


def map_logs(
    logs: Annotated[
        list[Path],
        typer.Argument(
            metavar="LOG...", help="CARMEN logs (.log, .clf, .gz), ROS bags (.bag, .mcap, .db3), log.npz, or runs."
        ),
    ],
    out: Annotated[
        Path,
        typer.Option("--out", parser=path, help="Folder to write; older maps there are replaced. Several maps: a run."),
    ],
    mapper: MapperOption = LOG_ODDS,
    poses: Annotated[
        str | None, typer.Option(help=f"Poses to map with: {', '.join(LOG_POSES)}; default: {LOG_POSES[0]}.")
    ] = None,
    resolution: Resolution = 0.05,
    model: Model = "octomap",
    clear_range: ClearRange = 0.0,
    start: Annotated[float, typer.Option(help="Skip the first seconds of the log [s].")] = 0.0,
    end: Annotated[
        float | None, typer.Option(help="Stop this long after the first scan [s]; default: at the last one.")
    ] = None,
    parts: Annotated[int, typer.Option(help="Number of maps per log, as if from several robots.")] = 1,
    max_rate: Annotated[float, typer.Option(help="Maximum scan rate [Hz]; faster logs are subsampled.")] = 10.0,
    scan_topic: Annotated[str | None, typer.Option(help="Topic of the scans, if a bag has several.")] = None,
    odom_topic: Annotated[
        str | None, typer.Option(help="nav_msgs/Odometry topic; default: tf, else the only topic.")
    ] = None,
    odometry: Annotated[
        Path | None, typer.Option(metavar="TUM", help="Trajectory file to use in place of the log's odometry.")
    ] = None,
    reference: Annotated[
        Path | None, typer.Option(metavar="TUM", help="Trajectory file to use in place of the log's reference poses.")
    ] = None,
    changes: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Any setting of mapping by its dotted name: mapping.resolution=0.1. Repeatable.",
        ),
    ] = None,
) -> int:
    """Build the map of a robot's log; write map, trajectory, pose graph and a picture.

    Example: mapquilt map floor.bag --out maps/floor
    """
    settings = _settings(
        mapper=mapper,
        poses=poses,
        resolution=resolution,
        model=model,
        clear_range=clear_range,
        changes=changes or (),
    )
    source = LogSource(scan_topic, odom_topic, odometry, reference, start, end, max_rate)
    if len(logs) > 1 and not (odometry is None and reference is None):
        raise ValueError(f"--odometry and --reference: must go with one log, not with {len(logs)}")
    spare_inputs(out, [*logs, *(each for each in (odometry, reference) if each is not None)])
    refuse_map_folder(out, several=len(logs) > 1 or parts > 1)
    named = cut_logs(_load(logs, source), parts)
    with count_progress(f"{mapping_label()}, scans") as on_progress:
        drawn = draw_logs(named, settings, on_progress)
    if len(drawn) == 1:
        write_log_map(out, drawn[0])
    else:
        with count_progress("comparing with the reference") as on_progress:
            done = itertools.count(1)
            write_log_run(out, drawn, parts, lambda: on_progress(next(done), reference_steps(len(drawn))))
    print_table(_table(out, drawn))
    return ALL_MERGED


def _settings(
    *, mapper: str, poses: str | None, resolution: float, model: str, clear_range: float, changes: Sequence[str]
) -> MappingSettings:
    if poses is not None and poses not in LOG_POSES:
        raise ValueError(f"--poses {poses}: must be one of {', '.join(LOG_POSES)}")
    require_settings_of(("mapping",), changes)
    named = TRUE_POSES if poses == REFERENCE else poses or LOG_POSES[0]
    mapping = MappingSettings(named, resolution, model, clear_range, mapper=mapper)
    mapping = with_assignments(ExperimentConfig(mapping=mapping), "--set", changes, COMBINED).mapping
    require_no_poses(mapping, poses)
    return mapping


def _load(paths: Sequence[Path], source: LogSource) -> tuple[NamedLog, ...]:
    logs: list[NamedLog] = []
    for each in paths:
        with count_progress(f"reading {each.name}") as on_progress:
            found = load_log(each, source, on_progress)
        for log in found:
            warn(tuple(f"{each}: {text}" for text in log.recorded.warnings))
        logs += found
    return tuple(logs)


def _table(out: Path, maps: Sequence[LogMap]) -> Table:
    """Tabulate each map's scans, path, pose graph and error."""
    numbers = ("scans", "s", "m driven", "keyframes", "loops", "RMSE m", "max m")
    table = plain_table(("map", False), *((name, True) for name in numbers))
    for one in maps:
        stamps = one.recorded.log.odometry.stamps
        error = None if one.error is None else Spread.of(one.error.position)
        table.add_row(
            one.name,
            str(len(stamps)),
            f"{stamps[-1] - stamps[0]:.0f}",
            f"{one.result.trajectory.distance():.1f}",
            str(one.result.keyframes.size or "-"),
            str(len(one.result.loops)) if one.result.edges else "-",
            "-" if error is None else f"{error.rmse:.3f}",
            "-" if error is None else f"{error.max:.3f}",
        )
    table.caption = f"{out}: poses: {maps[0].poses}"
    return table
