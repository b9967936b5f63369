"""``mapquilt merge``: merge maps."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from mapping.geometry.scale_range import ScaleRange
from mapping.io.map_file import UnknownGrey
from mapquilt.cli.exit_status import ALL_MERGED, SOME_REFUSED
from mapquilt.cli.merge_notes import advice, files_note, transform_notes
from mapquilt.cli.options.files import Unknown, path, unknown_grey
from mapquilt.cli.options.merge import (
    FusionOption,
    PriorOption,
    ReferenceOption,
    TrustOption,
    pair_workers,
    parse_priors,
)
from mapquilt.cli.options.workers import SchedulerOption, chosen_workers
from mapquilt.cli.tables import doubled_walls, merge_table, print_table, warn
from mapquilt.dataset.manifest import is_dataset
from mapquilt.jobs.progress import count_progress, pair_progress
from mapquilt.jobs.runner import Runner, Workers, remote_runner
from mapquilt.leaves import with_assignments
from mapquilt.logs.log_files import is_bag
from mapquilt.merging.debug import METHOD, refuse_debug, show_steps
from mapquilt.merging.merge_again import answers_before, settings_before, unmerged
from mapquilt.merging.merge_file import MergeTree, merge_record
from mapquilt.merging.merge_folder import merge_run, refuse_merge, write_merge
from mapquilt.merging.merge_inputs import MergeInputs, added_inputs, read_merge, run_inputs
from mapquilt.merging.path_inputs import path_inputs
from mapquilt.runs import folder as run_folder
from merge.fusion import FUSIONS, FusionName
from merge.merger import merge_maps
from merge.methods import method_names, published_names
from merge.progress import listening
from merge.records.result import MergeResult, PairResult
from merge.settings import MergeSettings
from merge.verification.settings import AcceptanceSettings


def merge(
    maps: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN | DATASET | MAP...",
            help="A run folder, a data set, or maps: map_server YAML, PGM or PNG, or logs of robots to map first.",
        ),
    ],
    method: Annotated[
        str | None, typer.Option(help=f"Merging method: {', '.join(method_names())}.", show_default="quilt")
    ] = None,
    scale: Annotated[
        str | None,
        typer.Option(
            help="known, free (0.5 to 2), LO:HI, or auto: known if every resolution can be trusted.",
            show_default="auto",
        ),
    ] = None,
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
    fusion: FusionOption = None,
    prior: PriorOption = None,
    trust_priors: TrustOption = False,
    add: Annotated[
        list[Path] | None,
        typer.Option(
            "--add",
            metavar="MAP",
            help="Add this map to the merge in RUN (or in an older --out) without matching the "
            "others again. It replaces a map of the same name. Settings stay those of that merge. Repeatable.",
        ),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="With --add: write the merge even if it joins fewer maps than before.")
    ] = False,
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
    seed: Annotated[int | None, typer.Option(help="Seed of the method's random samples.", show_default="0")] = None,
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

    Exit status 1 if a map was refused.

    Example: mapquilt merge floor_a.yaml floor_b.yaml --out merged
    """
    chosen = _Chosen(
        method, scale, as_published, min_confidence, reference, fusion, prior or (), trust_priors, changes or ()
    )
    settings, grey = chosen.over(MergeSettings()), unknown_grey(unknown)
    if dry_run:
        return ALL_MERGED
    if len(maps) == 1 and is_dataset(maps[0]):
        if add or out or debug or unknown or chosen.priors or as_json:
            raise ValueError(
                f"{maps[0]}: is a data set, to which --add, --out, --debug, --unknown, --prior and --json do not apply"
            )
        return _merge_dataset(maps[0], settings, seed or 0, chosen_workers(workers, scheduler))
    before: dict[str, Any] | None = None
    answers: dict[tuple[str, str], PairResult] = {}
    if add:
        folder: Path | None = _folder_to_extend(maps, add[0], out)
        before, inputs = read_merge(maps[0]), added_inputs(maps[0], add, grey)
        settings = chosen.over(settings_before(before, inputs.maps.resolutions_trusted))
        seed = before["seed"] if seed is None else seed
        answers = answers_before(maps[0], inputs.maps, settings, seed)
    else:
        inputs, folder = _merge_inputs(maps, out, grey)
    seed = seed or 0
    if debug is not None:
        refuse_debug(debug, settings, maps)
    warn(inputs.warnings)

    def may_write(result: MergeResult) -> bool:
        return force or before is None or not unmerged(before, result)

    with (
        remote_runner(pair_workers(len(inputs.maps), workers, scheduler)) as runner,
        pair_progress() as (on_progress, on_iteration),
        listening(on_iteration),
    ):
        if folder is not None and run_folder.is_run(folder):
            result, written = merge_run(folder, settings, seed, on_progress, inputs, runner, answers, may_write)
        else:
            result, written = merge_maps(inputs.maps, settings, seed, on_progress, runner, answers), ()
            if folder is not None and may_write(result):
                written = write_merge(folder, inputs, settings, seed, result)
    if settings.method == METHOD:
        warn(show_steps(inputs.maps, settings, debug))
    if as_json:
        typer.echo(json.dumps(merge_record(inputs, settings, seed, result), allow_nan=False))
    else:
        print_table(merge_table(inputs.maps, result, alternatives))
        for note in (transform_notes(inputs.maps, result), files_note(folder, written) if may_write(result) else ""):
            if note:
                typer.echo(f"\n{note}")
    warn(doubled_walls(result, written=folder is not None))
    if before is not None and before["reference"] != result.reference:
        warn(
            (f"the frame of the answer is now that of {result.reference}, and no longer that of {before['reference']}",)
        )
    for name, reason in result.left_out.items():
        typer.echo(f"mapquilt: {name} was not merged: {reason}", err=True)
    for tip in advice(result, folder if written else None):
        typer.echo(f"mapquilt: try: {tip}", err=True)
    if before is not None and not may_write(result):
        first, second = unmerged(before, result)[0]
        typer.echo(
            f"mapquilt: {folder}: was not changed, because {first} and {second} are merged there and no longer would "
            "be; --force writes the new merge",
            err=True,
        )
        return SOME_REFUSED
    return SOME_REFUSED if result.left_out else ALL_MERGED


def _merge_dataset(folder: Path, settings: MergeSettings, seed: int, workers: Workers) -> int:
    """Merge each sample of a data set in place, and print how many maps were refused."""
    from mapquilt.dataset.answers import merge_samples  # here: merging map files needs no simulator

    with Runner(workers) as runner, count_progress("samples") as on_progress:
        left_out = merge_samples(folder, settings, seed, runner, on_progress)
    refused = {name: names for name, names in left_out.items() if names}
    print_table(
        f"{folder}: {len(left_out)} samples merged in place, {len(refused)} of them without "
        f"{sum(map(len, refused.values()))} refused maps; mapquilt score {folder} compares them with the truth"
    )
    return SOME_REFUSED if refused else ALL_MERGED


@dataclass(frozen=True)
class _Chosen:
    """Options of the call that change settings; None leaves a setting as it is."""

    method: str | None
    scale: str | None
    as_published: bool
    min_confidence: float | None
    reference: str | None
    fusion: str | None
    priors: Sequence[str]
    trust_priors: bool
    changes: Sequence[str]

    def over(self, settings: MergeSettings) -> MergeSettings:
        """Return the settings with those of this call. Raises ``ValueError`` that names the option."""
        given: dict[str, Any] = {}
        if self.method is not None or self.as_published:
            given |= {"method": self.method or settings.method, "as_published": self.as_published}
        if self.scale is not None:
            given["scale"] = ScaleRange.parse(self.scale)
        if self.min_confidence is not None:
            given["acceptance"] = _acceptance(settings.acceptance, self.min_confidence, self.as_published)
        if self.reference is not None:
            given["reference"] = self.reference
        if self.fusion is not None:
            given["fusion"] = _fusion(self.fusion)
        if self.trust_priors:
            given["trust_priors"] = True
        if self.priors:
            new = parse_priors(self.priors)
            named = {prior.name for prior in new}
            given["priors"] = (*(prior for prior in settings.priors if prior.name not in named), *new)
        changed = dataclasses.replace(settings, **given)
        return with_assignments(MergeTree(changed), "--set", self.changes).merge


def _folder_to_extend(maps: list[Path], added: Path, out: Path | None) -> Path:
    if len(maps) != 1 or not maps[0].is_dir():
        raise ValueError(f"--add {added}: must follow one folder: a run, or an older merge")
    if out is not None:
        raise ValueError(f"--out {out}: not allowed with --add, which writes into the folder of the merge")
    return maps[0]


def _merge_inputs(maps: list[Path], out: Path | None, unknown: UnknownGrey) -> tuple[MergeInputs, Path | None]:
    """Return the maps to merge, and the folder of the answer."""
    if len(maps) == 1 and maps[0].is_dir() and not is_bag(maps[0]):
        if out is not None:
            raise ValueError(f"--out {out}: not allowed for a run, which stores its merge in its own folder")
        if unknown is not None:
            raise ValueError("--unknown: applies to map files only, not to a run")
        return run_inputs(maps[0]), maps[0]
    with count_progress("mapping logs") as on_progress:
        inputs = path_inputs(maps, unknown, on_progress)
    if out is not None:
        refuse_merge(out, maps)
    return inputs, out


def _fusion(name: str) -> FusionName:
    for known in FUSIONS:
        if name == known:
            return known
    raise ValueError(f"--fusion {name}: must be one of {', '.join(FUSIONS)}")


def _acceptance(settings: AcceptanceSettings, min_confidence: float, as_published: bool) -> AcceptanceSettings:
    if as_published:
        raise ValueError(f"--min-confidence {min_confidence:g}: not allowed with --as-published")
    return dataclasses.replace(settings, min_confidence=min_confidence)
