"""``mapquilt benchmark``: compare methods on pairs whose transform is known, and export the pairs without it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from mapping.geometry.scale_range import ScaleRange
from mapping.seeds import Role, stream
from mapping.wording import counted
from mapquilt.benchmark.exchange.answers import GivenAnswer, named_files, read_answers
from mapquilt.benchmark.exchange.export import EXPORT_FILE, write_export
from mapquilt.benchmark.exchange.identity import by_identity, data_digest
from mapquilt.benchmark.files import SUMMARY_FILE, TABLE_FILE, write_folder
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.pair_list import read_pair_list
from mapquilt.benchmark.pair_sets import dataset_pairs, even_sample
from mapquilt.benchmark.results import build_results
from mapquilt.benchmark.table import calibration_table, terminal_table
from mapquilt.benchmark.trials import chosen_methods, run_benchmark
from mapquilt.cli.application import new_app
from mapquilt.cli.options.merge import SCALE_HELP
from mapquilt.cli.options.workers import SchedulerOption, chosen_workers
from mapquilt.cli.tables import print_table
from mapquilt.jobs.journal import TASKS_FILE, remove_job, unfinished_folder
from mapquilt.jobs.progress import count_progress
from mapquilt.jobs.runner import Runner
from mapquilt.runs.folder import refuse_foreign, spare_inputs
from merge.methods import method_names, published_names

DEFAULT_METHODS = ("quilt", "sift", "orb")

MOST_DRAWN = 1200
"""Pairs of a method that are drawn by default: a hundred pages, more than anyone looks at, in some minutes."""

app = new_app()

PairLists = Annotated[
    list[Path] | None,
    typer.Option("--pairs", metavar="FILE", help="JSON list of map pairs with their truth. Repeatable."),
]
Split = Annotated[str | None, typer.Option(help="Split of the data sets to use; default: all.")]
Limit = Annotated[int | None, typer.Option(help="Number of pairs to use, drawn evenly from all strata; default: all.")]


@app.callback(invoke_without_command=True)
def benchmark(
    context: typer.Context,
    out: Annotated[Path | None, typer.Option(help="Folder to write; a benchmark there is replaced.")] = None,
    pairs: PairLists = None,
    dataset: Annotated[list[Path] | None, typer.Option(metavar="DIR", help="Finished data set. Repeatable.")] = None,
    split: Split = None,
    method: Annotated[
        list[str] | None,
        typer.Option(
            help=f"{', '.join(method_names())}. Repeatable; default: {', '.join(DEFAULT_METHODS)}, "
            "or none with --answers."
        ),
    ] = None,
    answers: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[NAME=]FILE",
            help="CSV file of another program's answers to the exported pairs; NAME is that of the file without "
            "extension, unless given. Repeatable.",
        ),
    ] = None,
    as_published: Annotated[
        bool,
        typer.Option(
            "--as-published",
            help=f"Also run methods with their own acceptance rule: {', '.join(published_names())}.",
        ),
    ] = False,
    scale: Annotated[str, typer.Option(help=SCALE_HELP)] = "auto",
    limit: Limit = None,
    seed: Annotated[int, typer.Option(help="Seed of the sample, the methods and the intervals.")] = 0,
    workers: Annotated[
        int, typer.Option(min=1, help="Number of processes; more than one disturbs the measured times.")
    ] = 1,
    scheduler: SchedulerOption = None,
    pictures: Annotated[
        int | None,
        typer.Option(
            min=0,
            help=f"Greatest number of pairs per method to draw, errors first; default: every pair, but at most "
            f"{MOST_DRAWN:,}.",
        ),
    ] = None,
) -> int:
    """Compare methods on pairs whose transform is known, with tables, records and pictures of every pair.

    An answer is right within 2 degrees, 3 % of scale and 1.5 % of the target's diagonal. See docs/benchmark.md.
    After an interruption the same command continues. Other programs take part by the files of `benchmark export`.

    Example: mapquilt benchmark --dataset data --split test --out bench
    """
    if context.invoked_subcommand is not None:
        _refuse_options_before(context)
        return 0
    if out is None:
        raise ValueError("--out is missing: name the folder to write")
    ranges = None if scale == "auto" else ScaleRange.parse(scale)
    methods = chosen_methods(method or (() if answers else DEFAULT_METHODS), ranges, as_published)
    files = named_files(answers or (), method_names())
    spare_inputs(out, [*(pairs or ()), *(dataset or ()), *files.values()])
    refuse_foreign(out, SUMMARY_FILE)
    chosen = _chosen_pairs(pairs or (), dataset or (), split, limit, seed)
    searched = scale if ranges is None else f"{ranges.low:g}:{ranges.high:g}"
    settings = {"scale": searched, "seed": seed, "data": data_digest(chosen)}
    given = _given_answers(files, chosen)
    with Runner(chosen_workers(workers, scheduler)) as runner, count_progress("pairs") as on_progress:
        evaluated = run_benchmark(chosen, methods, seed, runner, on_progress, unfinished_folder(out), given)
    results = build_results(evaluated, seed)
    with count_progress("pictures of methods") as on_progress:
        write_folder(out, results, settings, MOST_DRAWN if pictures is None else pictures, on_progress)
    remove_job(unfinished_folder(out), TASKS_FILE)
    print_table(terminal_table(results))
    if results.calibrations:
        print_table(calibration_table(results))
    ran = counted(len(results.methods), "method")
    print_table(f"{out}: {counted(len(chosen), 'pair')}, {ran}; see {out / TABLE_FILE}")
    return 0


@app.command("export")
def export(
    out: Annotated[Path, typer.Option(help="Folder to write; an export there is replaced.")],
    dataset: Annotated[list[Path] | None, typer.Argument(metavar="DIR", help="Finished data sets.")] = None,
    pairs: PairLists = None,
    split: Split = None,
    limit: Limit = None,
    seed: Annotated[int, typer.Option(help="Seed of the sample, as for `benchmark`.")] = 0,
) -> int:
    """Write the maps of all pairs, and a list without their truth, for a program of your own.

    `mapquilt benchmark --answers FILE` with the same pairs, --split, --limit and --seed scores its answers.

    Example: mapquilt benchmark export data --split test --out pairs
    """
    spare_inputs(out, [*(pairs or ()), *(dataset or ())])
    refuse_foreign(out, EXPORT_FILE)
    if not pairs and not dataset:
        raise ValueError("no pairs to export: give --pairs FILE or the folder of a data set")
    chosen = by_identity(_chosen_pairs(pairs or (), dataset or (), split, limit, seed))
    with count_progress("pairs") as on_progress:
        maps = write_export(out, chosen, on_progress)
    print_table(f"{out / EXPORT_FILE}: {counted(len(chosen), 'pair')} of {counted(maps, 'map')}")
    return 0


def _refuse_options_before(context: typer.Context) -> None:
    """Raise ``ValueError`` for an option that stands before the name of a command, where it has no effect."""
    for name in context.params:
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE":
            command = context.invoked_subcommand
            raise ValueError(f"--{name.replace('_', '-')}: has no effect before {command}; give it after {command}")


def _given_answers(files: Mapping[str, Path], pairs: Sequence[BenchmarkPair]) -> list[tuple[GivenAnswer, ...]]:
    """Read the answers of each program, pair by pair."""
    if not files:
        return []
    names = {pair.info.title: name for name, pair in by_identity(pairs).items()}
    read = [read_answers(file, name, dict.fromkeys(names.values())) for name, file in files.items()]
    return [tuple(answers[names[pair.info.title]] for answers in read) for pair in pairs]


def _chosen_pairs(
    files: Sequence[Path], folders: Sequence[Path], split: str | None, limit: int | None, seed: int
) -> list[BenchmarkPair]:
    if not files and not folders:
        raise ValueError("no pairs to run on: give --pairs FILE or --dataset DIR")
    if split is not None and not folders:
        raise ValueError(f"--split {split}: applies to data sets only; give one with --dataset")
    found = [pair for path in files for pair in read_pair_list(path)]
    found += [pair for folder in folders for pair in dataset_pairs(folder, split)]
    if not found:
        raise ValueError(f"{folders[0]}: has no pair of maps")
    if limit is None:
        return found
    return even_sample(found, limit, stream(seed, Role.BENCHMARK_SAMPLE))
