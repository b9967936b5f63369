"""``mapquilt merge``: merge maps."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from mapping.geometry.scale_range import ScaleRange
from mapquilt.cli.exit_status import ALL_MERGED, SOME_REFUSED
from mapquilt.cli.options.files import Unknown, path
from mapquilt.cli.options.merge import (
    FusionOption,
    PriorOption,
    ReferenceOption,
    pair_workers,
    parse_priors,
)
from mapquilt.cli.options.workers import SchedulerOption
from mapquilt.cli.tables import doubled_walls, merge_table, print_table, warn
from mapquilt.jobs.progress import count_progress
from mapquilt.jobs.runner import remote_runner
from mapquilt.leaves import with_assignments
from mapquilt.logs.log_files import is_bag
from mapquilt.merging.debug import METHOD, refuse_debug, show_steps
from mapquilt.merging.merge_again import answers_before
from mapquilt.merging.merge_file import MergeTree, merge_record
from mapquilt.merging.merge_folder import merge_run, refuse_merge, write_merge
from mapquilt.merging.merge_inputs import MergeInputs, added_inputs, run_inputs
from mapquilt.merging.path_inputs import path_inputs
from mapquilt.runs import folder as run_folder
from merge.fusion import FUSIONS, FusionName
from merge.merger import merge_maps
from merge.methods import method_names, published_names
from merge.records.result import PairResult
from merge.settings import MergeSettings
from merge.verification.settings import AcceptanceSettings


def merge(
    maps: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN | MAP...",
            help="A run folder, or maps: map_server YAML, PGM or PNG, or logs of robots to map first.",
        ),
    ],
    method: Annotated[str, typer.Option(help=f"Merging method: {', '.join(method_names())}.")] = "quilt",
    scale: Annotated[
        str, typer.Option(help="known, free (0.5 to 2), LO:HI, or auto: known if every resolution can be trusted.")
    ] = "auto",
    as_published: Annotated[
        bool,
        typer.Option(
            "--as-published",
            help=f"Use the method's own acceptance rule: {', '.join(published_names())}.",
        ),
    ] = False,
    min_confidence: Annotated[
        float | None,
        typer.Option(
            help=f"Least confidence of accepted pairs, 0 to 1. [default: {AcceptanceSettings.min_confidence}]"
        ),
    ] = None,
    alternatives: Annotated[
        bool, typer.Option("--alternatives", help="Also list the best other placements of each pair.")
    ] = False,
    reference: ReferenceOption = None,
    fusion: FusionOption = "log_odds",
    prior: PriorOption = None,
    add: Annotated[
        list[Path] | None,
        typer.Option(
            "--add",
            metavar="MAP",
            help="Add this map to the merge in RUN (or in an older --out) without matching the "
            "others again. It replaces a map of the same name. Repeatable.",
        ),
    ] = None,
    changes: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Any setting of the merge by its dotted name: acceptance.min_overlap=0.2. Repeatable.",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(min=1, help="Number of processes; default: one per core for more than 6 maps, otherwise one."),
    ] = None,
    scheduler: SchedulerOption = None,
    seed: Annotated[int, typer.Option(help="Seed of the method's random samples.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option(parser=path, help="New folder, or one of an older merge, for the result; a run stores it itself."),
    ] = None,
    debug: Annotated[
        Path | None,
        typer.Option(
            "--debug", metavar="DIR", parser=path, help="With --method morphology: folder for a picture of every step."
        ),
    ] = None,
    unknown: Unknown = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print only the record, on standard output.")] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check the options and quit; the maps need not exist yet.")
    ] = False,
) -> int:
    """Find the transforms between maps, and merge each group of connected maps into one map.

    Exit status 1 if a map was refused. Example: mapquilt merge floor_a.yaml floor_b.yaml --out merged
    """
    settings = MergeSettings(
        method=method,
        scale=ScaleRange.parse(scale),
        as_published=as_published,
        acceptance=_acceptance(min_confidence, as_published),
        reference=reference,
        fusion=_fusion(fusion),
        priors=parse_priors(prior or ()),
    )
    settings = with_assignments(MergeTree(settings), "--set", changes or ()).merge
    if dry_run:
        return ALL_MERGED
    if debug is not None:
        refuse_debug(debug, settings, maps)
    inputs, folder, answers = _merge_inputs(maps, add or [], out, unknown, settings, seed)
    warn(inputs.warnings)
    with (
        remote_runner(pair_workers(len(inputs.maps), workers, scheduler)) as runner,
        count_progress("merging pairs") as on_progress,
    ):
        if folder is not None and run_folder.is_run(folder):
            result = merge_run(folder, settings, seed, on_progress, inputs, runner, answers)
        else:
            result = merge_maps(inputs.maps, settings, seed, on_progress, runner, answers)
            if folder is not None:
                write_merge(folder, inputs, settings, seed, result)
    if method == METHOD:
        warn(show_steps(inputs.maps, settings, debug))
    if as_json:
        typer.echo(json.dumps(merge_record(inputs, settings, seed, result), allow_nan=False))
    else:
        print_table(merge_table(inputs.maps, result, alternatives))
    warn(doubled_walls(result))
    for name, reason in result.left_out.items():
        typer.echo(f"mapquilt: {name} was not merged: {reason}", err=True)
    return SOME_REFUSED if result.left_out else ALL_MERGED


def _merge_inputs(
    maps: list[Path], add: list[Path], out: Path | None, unknown: int | None, settings: MergeSettings, seed: int
) -> tuple[MergeInputs, Path | None, dict[tuple[str, str], PairResult]]:
    """Return the maps to merge, the folder of the answer, and the known answers of pairs."""
    if add:
        if len(maps) != 1 or not maps[0].is_dir():
            raise ValueError(f"--add {add[0]}: must follow one folder: a run, or an older merge")
        if out is not None:
            raise ValueError(f"--out {out}: not allowed with --add, which writes into the folder of the merge")
        inputs = added_inputs(maps[0], add, unknown)
        return inputs, maps[0], answers_before(maps[0], inputs.maps, settings, seed)
    if len(maps) == 1 and maps[0].is_dir() and not is_bag(maps[0]):
        if out is not None:
            raise ValueError(f"--out {out}: not allowed for a run, which stores its merge in its own folder")
        if unknown is not None:
            raise ValueError("--unknown: applies to map files only, not to a run")
        return run_inputs(maps[0]), maps[0], {}
    with count_progress("mapping logs") as on_progress:
        inputs = path_inputs(maps, unknown, on_progress)
    if out is not None:
        refuse_merge(out, maps)
    return inputs, out, {}


def _fusion(name: str) -> FusionName:
    for known in FUSIONS:
        if name == known:
            return known
    raise ValueError(f"--fusion {name}: must be one of {', '.join(FUSIONS)}")


def _acceptance(min_confidence: float | None, as_published: bool) -> AcceptanceSettings:
    if min_confidence is None:
        return AcceptanceSettings()
    if as_published:
        raise ValueError(f"--min-confidence {min_confidence:g}: not allowed with --as-published")
    return AcceptanceSettings(min_confidence=min_confidence)
