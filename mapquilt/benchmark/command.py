"""``mapquilt benchmark``: methods against pairs whose transform is known."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from mapping.geometry.scale_range import ScaleRange
from mapping.seeds import Role, stream
from mapquilt.benchmark.dataset_pairs import dataset_pairs
from mapquilt.benchmark.files import TABLE_FILE
from mapquilt.benchmark.folder import claim_folder, write_folder
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.pair_file import read_pairs
from mapquilt.benchmark.report import build_report
from mapquilt.benchmark.run import chosen_methods, run_benchmark
from mapquilt.benchmark.selection import even_sample
from mapquilt.benchmark.table import calibration_table, terminal_table
from mapquilt.cli.options.workers import SchedulerOption, WorkersOption, chosen_workers
from mapquilt.cli.tables import print_table
from mapquilt.jobs.progress import count_progress
from mapquilt.jobs.runner import Runner
from merge.methods import PROPOSERS, PUBLISHED

DEFAULT_METHODS = ("quilt", "sift", "orb")


def benchmark(
    out: Annotated[Path, typer.Option(help="Folder to write; a benchmark there is replaced.")],
    pairs: Annotated[
        list[Path] | None, typer.Option(metavar="FILE", help="JSON list of map pairs with their truth. Repeatable.")
    ] = None,
    dataset: Annotated[list[Path] | None, typer.Option(metavar="DIR", help="Finished data set. Repeatable.")] = None,
    split: Annotated[str | None, typer.Option(help="Of the data sets, this split alone.")] = None,
    method: Annotated[
        list[str] | None,
        typer.Option(help=f"{', '.join(PROPOSERS)}. Repeatable; default: {', '.join(DEFAULT_METHODS)}."),
    ] = None,
    as_published: Annotated[
        bool,
        typer.Option(
            "--as-published",
            help=f"Also run methods by their own verdict, beside the common judge's: {', '.join(PUBLISHED)}.",
        ),
    ] = False,
    scale: Annotated[
        str, typer.Option(help="known, free (0.5 to 2), LO:HI, or auto: known if every resolution can be trusted.")
    ] = "auto",
    limit: Annotated[int | None, typer.Option(help="Run so many pairs, chosen evenly from all strata.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of the choice, the methods and the intervals.")] = 0,
    workers: WorkersOption = 1,
    scheduler: SchedulerOption = None,
    pictures: Annotated[
        int | None,
        typer.Option(min=0, help="Most pairs a method to draw, wrong and refused ones first; default: every pair."),
    ] = None,
) -> int:
    """Run methods on pairs whose transform is known: table, records, and pictures of every pair.

    A pair is right within 2 degrees, 3 % of scale and 1.5 % of the target's diagonal. See docs/benchmark.md.
    """
    methods = chosen_methods(
        method or DEFAULT_METHODS, None if scale == "auto" else ScaleRange.parse(scale), as_published
    )
    claim_folder(out)
    chosen = _chosen_pairs(pairs or (), dataset or (), split, limit, seed)
    with Runner(chosen_workers(workers, scheduler)) as runner, count_progress("pairs") as on_progress:
        trials = run_benchmark(chosen, methods, seed, runner, on_progress)
    report = build_report(methods, seed, trials)
    with count_progress("pictures of methods") as on_progress:
        write_folder(out, report, len(trials) if pictures is None else pictures, on_progress)
    print_table(terminal_table(report))
    if report.calibrations:
        print_table(calibration_table(report))
    print_table(f"{out}: {len(trials)} pairs, {len(methods)} methods; see {out / TABLE_FILE}")
    return 0


def _chosen_pairs(
    files: Sequence[Path], folders: Sequence[Path], split: str | None, limit: int | None, seed: int
) -> list[BenchmarkPair]:
    if not files and not folders:
        raise ValueError("nothing to run on: name --pairs FILE or --dataset DIR")
    if split is not None and not folders:
        raise ValueError(f"--split {split}: is for data sets; name one with --dataset")
    found = [pair for path in files for pair in read_pairs(path)]
    found += [pair for folder in folders for pair in dataset_pairs(folder, split)]
    if not found:
        raise ValueError(f"{folders[0]}: holds no pair")
    if limit is None:
        return found
    return even_sample(found, limit, stream(seed, Role.BENCHMARK_SAMPLE))
