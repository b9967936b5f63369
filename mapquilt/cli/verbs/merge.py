"""``mapquilt merge``: merge maps."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import typer

from mapping.geometry.scale_range import ScaleRange
from mapping.io.map_file import UnknownGrey
from mapping.io.safe_load import printable
from mapping.wording import counted
from mapquilt.cli.exit_status import ALL_MERGED, SOME_REFUSED
from mapquilt.cli.merge_notes import advice, files_note, transform_notes
from mapquilt.cli.options.files import Unknown, path, unknown_grey
from mapquilt.cli.options.merge import (
    SERIAL_MAPS,
    ElasticOption,
    FusionOption,
    PriorOption,
    ReferenceOption,
    ScaleOption,
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
from mapquilt.logs.log_files import is_bag, is_log
from mapquilt.merging.debug import METHOD, refuse_debug, show_steps
from mapquilt.merging.merge_again import answers_before, settings_before, unmerged
from mapquilt.merging.merge_file import MergeTree, merge_record
from mapquilt.merging.merge_folder import merge_run, refuse_merge, write_merge
from mapquilt.merging.merge_inputs import MergeInputs, added_inputs, read_merge, run_inputs
from mapquilt.merging.path_inputs import path_inputs
from mapquilt.merging.unfinished_merge import recording
from mapquilt.runs import folder as run_folder
from merge.fusion import FUSIONS, FusionName
from merge.merger import merge_maps
from merge.methods import method_names, published_names
from merge.pair.task import Runner as PairRunner
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
    scale: ScaleOption = None,
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
    elastic: ElasticOption = False,
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
        method=method,
        scale=scale,
        as_published=as_published,
        min_confidence=min_confidence,
        reference=reference,
        fusion=fusion,
        elastic=elastic,
        priors=prior or (),
        trust_priors=trust_priors,
        changes=changes or (),
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
    if add:
        job = _extension(chosen, maps, add, out, grey=grey, seed=seed, force=force)
    else:
        inputs, folder = _merge_inputs(maps, out, grey, settings, seed or 0)
        job = _Job(inputs, folder, settings, seed or 0)
    if debug is not None:
        refuse_debug(debug, job.settings, maps)
    warn(job.inputs.warnings)
    result, written = _run(job, pair_workers(len(job.inputs.maps), workers, scheduler))
    if job.settings.method == METHOD:
        warn(show_steps(job.inputs.maps, job.settings, debug))
    if as_json:
        typer.echo(json.dumps(merge_record(job.inputs, job.settings, job.seed, result), allow_nan=False))
    else:
        _print_result(job, result, written, alternatives)
    _print_warnings(job, result, written)
    return SOME_REFUSED if result.left_out or job.lost(result) else ALL_MERGED


@dataclass(frozen=True)
class _Job:
    """A merge to do; ``folder`` is that of the answer, None if nothing is to be written.

    With --add, ``before`` is the record of the merge to extend, and ``answers`` are the pairs that it has already.
    """

    inputs: MergeInputs
    folder: Path | None
    settings: MergeSettings
    seed: int
    before: Mapping[str, Any] | None = None
    answers: Mapping[tuple[str, str], PairResult] = field(default_factory=dict)
    force: bool = False

    def lost(self, result: MergeResult) -> tuple[tuple[str, str], ...]:
        """List the pairs of maps that were merged before and no longer would be; none with --force."""
        return () if self.force or self.before is None else unmerged(self.before, result)

    def may_write(self, result: MergeResult) -> bool:
        """Check that the result may replace the merge before."""
        return not self.lost(result)


def _extension(
    chosen: _Chosen,
    maps: list[Path],
    add: Sequence[Path],
    out: Path | None,
    *,
    grey: UnknownGrey,
    seed: int | None,
    force: bool,
) -> _Job:
    """Add maps to an older merge, with its settings and seed where the call names no others."""
    for added in add:
        if is_log(added):
            raise ValueError(f"--add {added}: is a log, must be a map; draw it first: mapquilt map LOG --out DIR")
    folder = _folder_to_extend(maps, add[0], out)
    before, inputs = read_merge(folder), added_inputs(folder, add, grey)
    settings = chosen.over(settings_before(before, inputs.maps.resolutions_trusted))
    seed = before["seed"] if seed is None else seed
    if settings.trust_priors and not chosen.trust_priors:
        _require_priors(folder, before, inputs.maps.names, settings)
    return _Job(inputs, folder, settings, seed, before, answers_before(folder, inputs.maps, settings, seed), force)


def _require_priors(folder: Path, before: Mapping[str, Any], names: Sequence[str], settings: MergeSettings) -> None:
    """Require a start pose of each map that is added to maps stitched at theirs."""
    known = {entry["name"] for entry in before["maps"]} | {prior.name for prior in settings.priors}
    for name in names:
        if name not in known:
            raise ValueError(
                f"--add: {folder} was stitched at start poses, and {name} has none; give --prior {name}:X,Y,YAW, or "
                "--trust-priors if it lies in the common frame"
            )


def _run(job: _Job, workers: Workers) -> tuple[MergeResult, tuple[Path, ...]]:
    """Merge, and write the answer if there is a folder; return the result and the files written."""
    inputs, folder = job.inputs, job.folder
    with (
        _pair_runner(job, workers) as runner,
        pair_progress() as (on_progress, on_iteration),
        listening(on_iteration),
    ):
        if folder is not None and run_folder.is_run(folder):
            return merge_run(
                folder, job.settings, job.seed, on_progress, inputs, runner, job.answers, may_write=job.may_write
            )
        result = merge_maps(inputs.maps, job.settings, job.seed, on_progress, runner, job.answers)
        if folder is None or not job.may_write(result):
            return result, ()
        return result, write_merge(folder, inputs, job.settings, job.seed, result)


@contextmanager
def _pair_runner(job: _Job, workers: Workers) -> Iterator[PairRunner | None]:
    """Start what matches the pairs; of more maps than one process merges, the answers stay on disk until the end."""
    if job.folder is None or len(job.inputs.maps) <= SERIAL_MAPS:
        with remote_runner(workers) as runner:
            yield runner
        return
    with Runner(workers) as runner, recording(job.folder, runner) as recorder:
        yield recorder


def _print_result(job: _Job, result: MergeResult, written: Sequence[Path], alternatives: bool) -> None:
    """Print the table of pairs, the transforms to paste, and the files written."""
    print_table(merge_table(job.inputs.maps, result, alternatives))
    notes = ["\n".join(job.inputs.notes), transform_notes(job.inputs.maps, result)]
    if job.may_write(result):
        alone = result.reference if len(result.reference_from_map) == 1 else None
        notes.append(files_note(job.folder, written, alone))
    for note in filter(None, notes):
        typer.echo(f"\n{note}")


def _print_warnings(job: _Job, result: MergeResult, written: Sequence[Path]) -> None:
    """Print on standard error what is doubtful, which maps were left out, and what to try."""
    warn(doubled_walls(result, written=job.folder is not None))
    if job.before is not None and job.before["reference"] != result.reference:
        old = job.before["reference"]
        warn((f"the frame of the answer is now that of {result.reference}, and no longer that of {old}",))
    for name in result.left_out:
        typer.echo(f"mapquilt: {printable(name)} was not merged", err=True)
    for tip in advice(job.inputs.maps, result, job.settings, job.folder if written else None):
        typer.echo(f"mapquilt: try: {tip}", err=True)
    for first, second in job.lost(result)[:1]:
        typer.echo(
            f"mapquilt: {job.folder}: was not changed, because {first} and {second} are merged there and no longer "
            "would be; --force writes the new merge",
            err=True,
        )


def _merge_dataset(folder: Path, settings: MergeSettings, seed: int, workers: Workers) -> int:
    """Merge each sample of a data set in place, and print how many maps were refused."""
    from mapquilt.dataset.answers import merge_samples  # here: merging map files needs no simulator

    with Runner(workers) as runner, count_progress("samples") as on_progress:
        left_out = merge_samples(folder, settings, seed, runner, on_progress)
    refused = {name: names for name, names in left_out.items() if names}
    without = ""
    if refused:
        maps = counted(sum(map(len, refused.values())), "map")
        without = f"; {maps} refused, in {counted(len(refused), 'sample')}"
    print_table(
        f"{folder}: {counted(len(left_out), 'sample')} merged in place{without}; mapquilt score {folder} compares them "
        "with the truth"
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
    elastic: bool
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
        if self.elastic:
            given["elastic"] = True
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


def _merge_inputs(
    maps: list[Path], out: Path | None, unknown: UnknownGrey, settings: MergeSettings, seed: int
) -> tuple[MergeInputs, Path | None]:
    """Return the maps to merge, and the folder of the answer."""
    if len(maps) == 1 and maps[0].is_dir() and not is_bag(maps[0]):
        if out is not None:
            raise ValueError(f"--out {out}: not allowed for a run, which stores its merge in its own folder")
        if unknown is not None:
            raise ValueError("--unknown: applies to map files only, not to a run")
        return run_inputs(maps[0]), maps[0]
    if out is not None:
        refuse_merge(out, maps)
    with count_progress("mapping logs") as on_progress:
        return path_inputs(maps, unknown, on_progress, settings, seed), out


def _fusion(name: str) -> FusionName:
    for known in FUSIONS:
        if name == known:
            return known
    raise ValueError(f"--fusion {name}: must be one of {', '.join(FUSIONS)}")


def _acceptance(settings: AcceptanceSettings, min_confidence: float, as_published: bool) -> AcceptanceSettings:
    if as_published:
        raise ValueError(f"--min-confidence {min_confidence:g}: not allowed with --as-published")
    return dataclasses.replace(settings, min_confidence=min_confidence)
