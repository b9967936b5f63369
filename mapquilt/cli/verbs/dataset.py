"""``mapquilt dataset``: make, check and list data sets."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mapping.io.atomic import write_bytes_atomically
from mapping.seeds import Role, stream
from mapping.wording import counted, duration
from mapquilt.benchmark.disturbance.folder import refuse_foreign_pairs, require_kinds, useful_pairs, write_disturbed
from mapquilt.benchmark.disturbance.kinds import KINDS
from mapquilt.benchmark.pair_list import PAIRS_FILE
from mapquilt.benchmark.pair_sets import dataset_pairs, even_sample
from mapquilt.benchmark.publication.export import SHARDS_FILE, WRITERS, export_dataset, require_format
from mapquilt.benchmark.world_split import with_worlds
from mapquilt.cli.application import new_app
from mapquilt.cli.exit_status import NOT_REACHED, Termination
from mapquilt.cli.options.workers import SchedulerOption, WorkersOption, chosen_workers
from mapquilt.cli.tables import print_table, warn
from mapquilt.dataset.card import draw_figures
from mapquilt.dataset.carried_plans import carry_plans
from mapquilt.dataset.estimate import Costs, Estimate, estimate
from mapquilt.dataset.listing import PairFilter, pair_table, selected_pairs
from mapquilt.dataset.make import make_dataset
from mapquilt.dataset.manifest import FAILURES_FILE, read_manifest
from mapquilt.dataset.plan import plan_dataset
from mapquilt.dataset.published import differences
from mapquilt.dataset.remake import remake_sample
from mapquilt.dataset.spec import READY, SECTIONS, key_rows, load_spec, ready_spec
from mapquilt.dataset.verify import verify_dataset
from mapquilt.jobs.journal import recover_folders
from mapquilt.jobs.progress import count_progress, dataset_progress
from mapquilt.jobs.runner import Runner
from mapquilt.runs.folder import refuse_foreign, spare_inputs
from mapquilt.viz.png import figure_png
from mapquilt.viz.text_table import plain_table

app = new_app(
    help="Make, check and list data sets: many samples from one specification.\n\n"
    "Example: mapquilt dataset make smoke --out data"
)

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a data set.")]

MOST_DIFFERENCES = 10
"""Most records that differ from the published ones and are listed."""


@app.command("init")
def init(
    out: Annotated[Path, typer.Argument(metavar="SPEC.yaml", help="File to write; never replaced.")],
    ready: Annotated[str, typer.Option("--from", help=f"Specification to start from: {', '.join(READY)}.")] = "smoke",
) -> int:
    """Write a commented specification to start from.

    Example: mapquilt dataset init spec.yaml --from smoke
    """
    if ready not in READY:
        raise ValueError(f"--from {ready}: must be one of {', '.join(READY)}")
    if out.exists():
        raise ValueError(f"{out}: exists already")
    out.parent.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(out, ready_spec(ready).encode())
    print_table(f"{out}: edit it, then mapquilt dataset make {out} --out DIR")
    return 0


@app.command("make")
def make(
    spec: Annotated[str, typer.Argument(metavar="SPEC", help=f"YAML file, or one of {', '.join(READY)}.")],
    out: Annotated[Path, typer.Option(help="Folder of the data set; an unfinished one continues.")],
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check the specification, and say what it makes and costs; write nothing.")
    ] = False,
    limit_samples: Annotated[
        int, typer.Option(help="Most samples that a specification may plan; more must be asked for.", min=1)
    ] = 100_000,
) -> int:
    """Make a data set. After an interruption the same command continues, and the result is the same to the byte.

    Exit status 1 if a sample cannot be made, 3 if a mission did not reach its overlap; all others are made. 75 if
    workers died or memory was short, several times: the set is unfinished, and the same command continues.

    Example: mapquilt dataset make smoke --out data
    """
    wanted, base = load_spec(spec), Path() if spec in READY else Path(spec).parent
    if wanted.total > limit_samples:
        time = duration(wanted.scans * Costs().seconds_per_scan)
        raise ValueError(
            f"{spec}: plans {wanted.total} samples, and the simulation alone takes {time} on one core; "
            f"at most {limit_samples} are made: lower count or per_mission, or raise --limit-samples"
        )
    carried = carry_plans(wanted, base)
    warn(carried.notes)
    chosen = chosen_workers(workers, scheduler)
    if dry_run:
        _print_estimate(spec, estimate(plan_dataset(carried.spec, carried.worlds)), chosen.processes)
        return 0
    with (
        Runner(chosen) as runner,
        dataset_progress(wanted.total) as on_progress,
    ):
        try:
            report = make_dataset(carried, out, runner, on_progress)
        except (KeyboardInterrupt, Termination):
            typer.echo(f"mapquilt: {out} is unfinished; the same command continues from here", err=True)
            raise
    if report.failures:
        planned = report.samples + report.failures
        print_table(
            f"{out}: {report.samples} of {counted(planned, 'sample')}; {report.failures} failed, "
            f"see {out / FAILURES_FILE}"
        )
        return 1
    print_table(f"{out}: {counted(report.samples, 'sample')}")
    if report.missed:
        warn((f"{counted(report.missed, 'mission')} did not reach the overlap; the nearest result is kept",))
        return NOT_REACHED
    return 0


def _print_estimate(spec: str, found: Estimate, workers: int) -> None:
    time = duration(3600.0 * found.hours / workers)
    if found.most_hours > found.hours:
        most = duration(3600.0 * found.most_hours / workers)
        time += f", at most {most} if all must be simulated again to reach their overlap,"
    counts = (
        counted(found.missions, "mission"),
        counted(found.samples, "sample"),
        counted(found.maps, "map"),
        counted(found.pairs, "pair"),
        counted(found.negatives, "pair of two worlds", "pairs of two worlds"),
    )
    print_table(f"{spec}: {', '.join(counts)}")
    print_table(f"about {time} on {counted(workers, 'core')}, and {found.gigabytes:.2g} GB")


@app.command("keys")
def keys() -> int:
    """List the keys of a specification with their units, defaults and examples.

    Example: mapquilt dataset keys
    """
    for section in SECTIONS:
        table = plain_table(("key", False), ("meaning", False), ("default", False), ("example", False))
        for name, about, unit, default, example in key_rows(section):
            table.add_row(name, f"{about} [{unit}]" if unit else about, default, example)
        table.title = f"in {section}" if section else "specification"
        print_table(table)
    return 0


@app.command("remake")
def remake(
    folder: Folder,
    sample: Annotated[str, typer.Argument(help="Name of the sample, such as 000012.")],
    out: Annotated[Path, typer.Option(help="New folder to write.")],
) -> int:
    """Make one sample again and compare it with the manifest, bit for bit.

    Exit status 1 if a file differs.

    Example: mapquilt dataset remake data 000012 --out again
    """
    different = remake_sample(folder, sample, out)
    if different:
        print_table(f"{out}: {counted(len(different), 'file')} unlike {folder}, the first is {different[0]}")
        return 1
    print_table(f"{out}: the same as in {folder}, bit for bit")
    return 0


@app.command("verify")
def verify(
    folder: Folder,
    repair: Annotated[
        bool, typer.Option("--repair", help="First finish or remove what a killed writer left in the folder.")
    ] = False,
    published: Annotated[
        bool, typer.Option("--published", help="Also compare with the published data set of the same name.")
    ] = False,
) -> int:
    """Check all that a reader uses: the manifest against its seal, its truth and itself, and every file by its hash.

    Exit status 1 if a file is missing, changed or in no record, or a record is wrong or not as it was published, and 2
    if there is no manifest that can be read, or no data set of its name and specification is published.

    Example: mapquilt dataset verify data
    """
    if repair:
        read_manifest(folder)  # only in a data set
        recover_folders(folder)
    with count_progress("hashing") as on_progress:
        problems = verify_dataset(folder, on_progress)
    found = differences(folder) if published and not problems else None
    for problem in problems:
        print_table(problem)
    print_table(f"{folder}: " + (counted(len(problems), "problem") if problems else "no file has changed"))
    if found is None:
        return 1 if problems else 0
    for line in found.lines[:MOST_DIFFERENCES]:
        print_table(line)
    differing = f"{counted(len(found.lines), 'record')} unlike the published data set of {found.generator}"
    same = f"equals the published data set of {found.generator}, bit for bit"
    print_table(f"{folder}: {differing if found.lines else same}")
    return 1 if found.lines else 0


@app.command("stats")
def stats(
    folder: Folder,
    out: Annotated[Path, typer.Option(help="Picture to write.")],
) -> int:
    """Draw histograms of a data set's properties.

    Example: mapquilt dataset stats data --out stats.png
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(out, figure_png(draw_figures(read_manifest(folder).samples)))
    print_table(f"{out}: drawn")
    return 0


@app.command("pairs")
def pairs(
    folder: Folder,
    split: Annotated[str | None, typer.Option(help="Only pairs of this split.")] = None,
    world: Annotated[str | None, typer.Option(help="Only pairs of this family.")] = None,
    overlap: Annotated[str, typer.Option(help="Only pairs of this true overlap, LO:HI.")] = "0:1",
    noise: Annotated[float | None, typer.Option(help="Only pairs of this noise level.")] = None,
    identifiable: Annotated[
        bool | None, typer.Option(help="Only pairs with one right answer, or only the others.")
    ] = None,
) -> int:
    """List the pairs of a data set by stratum.

    Example: mapquilt dataset pairs data --split test --overlap 0.3:1
    """
    wanted = PairFilter.parse(split, world, overlap, noise, identifiable)
    manifest = read_manifest(folder)
    wanted.require_present(folder, manifest)
    print_table(pair_table(selected_pairs(manifest, wanted)))
    return 0


@app.command("disturb")
def disturb(
    folder: Folder,
    out: Annotated[Path, typer.Option(help="Folder to write; disturbed pairs there are replaced.")],
    kind: Annotated[
        list[str] | None, typer.Option(help=f"{', '.join(KINDS)}. Repeatable; default: all in turn.")
    ] = None,
    overlap: Annotated[
        str, typer.Option(help="Only pairs of this true overlap, LO:HI; from 0 on also pairs to be refused.")
    ] = "0.3:1",
    split: Annotated[str | None, typer.Option(help="Only pairs of this split.")] = None,
    limit: Annotated[
        int | None, typer.Option(help="Number of pairs to disturb, drawn evenly from all strata; default: all.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the sample and of the disturbances.")] = 0,
) -> int:
    """Disturb pairs as real maps are: warps of 1 to 3 % of the diagonal, specks, thick walls, crops, gaps, furniture.

    Each pair with one right answer is disturbed once, in its source; its truth follows. Writes maps, overview.png, and
    pairs.json for mapquilt benchmark --pairs and mapquilt calibrate --pairs.

    Example: mapquilt dataset disturb data --kind warp-2 --kind gaps --out disturbed
    """
    kinds = tuple(dict.fromkeys(kind or KINDS))
    require_kinds(kinds)
    wanted = PairFilter.parse(split, None, overlap, None, None)
    spare_inputs(out, [folder])
    refuse_foreign_pairs(out)
    chosen = useful_pairs(with_worlds(dataset_pairs(folder, split)), wanted.low, wanted.high)
    if not chosen:
        raise ValueError(f"{folder}: has no pair with overlap {overlap}, one right answer and a fitted truth")
    if limit is not None:
        chosen = even_sample(chosen, limit, stream(seed, Role.BENCHMARK_SAMPLE))
    with count_progress("pairs") as on_progress:
        counts = write_disturbed(chosen, kinds, out, seed, on_progress)
    print_table(f"{out / PAIRS_FILE}: " + ", ".join(f"{number} {name}" for name, number in counts.items()))
    return 0


@app.command("export")
def export(
    folder: Folder,
    out: Annotated[Path, typer.Option(help="Folder to write; an export there is replaced.")],
    layout: Annotated[
        str, typer.Option("--format", help=f"{', '.join(WRITERS)} (Parquet with a description).")
    ] = "parquet",
    withhold_truth: Annotated[
        list[str] | None,
        typer.Option("--withhold-truth", metavar="SPLIT", help="Leave out the truth of this split. Repeatable."),
    ] = None,
    pairs_per_file: Annotated[
        int, typer.Option(min=1, help="Most pairs of a file; for croissant a split is one file.")
    ] = 2000,
) -> int:
    """Write all pairs with both maps as pictures and their truth, as other libraries read them.

    datasets.load_dataset opens each format; README.md and eval.yaml are what Hugging Face reads. Parquet needs the
    extra `export`: pip install 'mapquilt[export]'.

    Example: mapquilt dataset export data --format parquet --withhold-truth test --out hub
    """
    require_format(layout)
    spare_inputs(out, [folder])
    refuse_foreign(out, SHARDS_FILE)
    with count_progress("pairs") as on_progress:
        pairs = export_dataset(
            folder,
            out,
            layout,
            withheld=tuple(withhold_truth or ()),
            pairs_per_file=pairs_per_file,
            on_progress=on_progress,
        )
    print_table(f"{out}: " + ", ".join(f"{counted(number, 'pair')} of {split}" for split, number in pairs.items()))
    return 0
