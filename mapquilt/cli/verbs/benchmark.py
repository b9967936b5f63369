"""``mapquilt benchmark``: compare methods on pairs whose transform is known."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from mapping.geometry.scale_range import ScaleRange
from mapping.seeds import Role, stream
from mapping.wording import counted
from mapquilt.benchmark.files import SUMMARY_FILE, TABLE_FILE, write_folder
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.pair_list import read_pair_list
from mapquilt.benchmark.pair_sets import dataset_pairs, even_sample
from mapquilt.benchmark.results import build_results
from mapquilt.benchmark.table import calibration_table, terminal_table
from mapquilt.benchmark.trials import TASKS_FILE, chosen_methods, run_benchmark, unfinished_folder
from mapquilt.cli.options.merge import SCALE_HELP
from mapquilt.cli.options.workers import SchedulerOption, chosen_workers
from mapquilt.cli.tables import print_table
from mapquilt.jobs.journal import remove_job
from mapquilt.jobs.progress import count_progress
from mapquilt.jobs.runner import Runner
from mapquilt.runs.folder import refuse_foreign, spare_inputs
from merge.methods import method_names, published_names

DEFAULT_METHODS = ("quilt", "sift", "orb")


def benchmark(
    out: Annotated[Path, typer.Option(help="Folder to write; a benchmark there is replaced.")],
    pairs: Annotated[
        list[Path] | None, typer.Option(metavar="FILE", help="JSON list of map pairs with their truth. Repeatable.")
    ] = None,
    dataset: Annotated[list[Path] | None, typer.Option(metavar="DIR", help="Finished data set. Repeatable.")] = None,
    split: Annotated[str | None, typer.Option(help="Split of the data sets to run on; default: all.")] = None,
    method: Annotated[
        list[str] | None,
        typer.Option(help=f"{', '.join(method_names())}. Repeatable; default: {', '.join(DEFAULT_METHODS)}."),
    ] = None,
    as_published: Annotated[
        bool,
        typer.Option(
            "--as-published",
            help=f"Also run methods with their own acceptance rule: {', '.join(published_names())}.",
        ),
    ] = False,
    scale: Annotated[str, typer.Option(help=SCALE_HELP)] = "auto",
    limit: Annotated[
        int | None, typer.Option(help="Number of pairs to run, drawn evenly from all strata; default: all.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the sample, the methods and the intervals.")] = 0,
    workers: Annotated[
        int, typer.Option(min=1, help="Number of processes; more than one disturbs the measured times.")
    ] = 1,
    scheduler: SchedulerOption = None,
    pictures: Annotated[
        int | None,
        typer.Option(min=0, help="Greatest number of pairs per method to draw, errors first; default: every pair."),
    ] = None,
) -> int:
    """Compare methods on pairs whose transform is known, with tables, records and pictures of every pair.

    An answer is right within 2 degrees, 3 % of scale and 1.5 % of the target's diagonal. See docs/benchmark.md.
    After an interruption the same command continues.

    Example: mapquilt benchmark --dataset data --split test --out bench
    """
    ranges = None if scale == "auto" else ScaleRange.parse(scale)
    methods = chosen_methods(method or DEFAULT_METHODS, ranges, as_published)
    spare_inputs(out, [*(pairs or ()), *(dataset or ())])
    refuse_foreign(out, SUMMARY_FILE)
    chosen = _chosen_pairs(pairs or (), dataset or (), split, limit, seed)
    with Runner(chosen_workers(workers, scheduler)) as runner, count_progress("pairs") as on_progress:
        answers = run_benchmark(chosen, methods, seed, runner, on_progress, unfinished_folder(out))
    results = build_results(answers, seed)
    settings = {"scale": scale if ranges is None else f"{ranges.low:g}:{ranges.high:g}", "seed": seed}
    with count_progress("pictures of methods") as on_progress:
        write_folder(out, results, settings, len(chosen) if pictures is None else pictures, on_progress)
    remove_job(unfinished_folder(out), TASKS_FILE)
    print_table(terminal_table(results))
    if results.calibrations:
        print_table(calibration_table(results))
    print_table(f"{out}: {counted(len(chosen), 'pair')}, {counted(len(methods), 'method')}; see {out / TABLE_FILE}")
    return 0


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
