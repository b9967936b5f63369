"""``mapquilt calibrate``: fit the constants of the acceptance rule."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from mapping.io.transaction import atomic_folder
from mapping.seeds import Role, stream
from mapping.wording import counted
from mapquilt.benchmark.files import RELIABILITY_PICTURE, calibration_record
from mapquilt.benchmark.fitting import FITTED, decide_again, fit_acceptance
from mapquilt.benchmark.held_out import HeldOut, hold_out_each
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.pair_list import read_pair_list
from mapquilt.benchmark.pair_sets import dataset_pairs, even_sample
from mapquilt.benchmark.trials import run_benchmark
from mapquilt.benchmark.world_split import WorldSplit, split_by_world
from mapquilt.cli.options.workers import SchedulerOption, WorkersOption, chosen_workers
from mapquilt.cli.tables import print_table
from mapquilt.evaluation.calibration import Calibration, calibration
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.formatting import number_text
from mapquilt.jobs.journal import TASKS_FILE, remove_job, unfinished_folder
from mapquilt.jobs.progress import count_progress
from mapquilt.jobs.runner import Runner
from mapquilt.json_file import write_record
from mapquilt.runs.folder import refuse_foreign, spare_inputs
from mapquilt.viz.png import figure_png
from mapquilt.viz.reliability import reliability_figure
from mapquilt.viz.text_table import plain_table
from merge.settings import MergeSettings
from merge.verification.settings import AcceptanceSettings

SCHEMA = "mapquilt-calibration/2"
CALIBRATION_FILE = "calibration.json"
JOBS = ("fit", "check", "hold out")
"""Parts of the work, by the use of their pairs."""


def calibrate(
    out: Annotated[Path, typer.Option(help="Folder to write; a calibration there is replaced.")],
    dataset: Annotated[list[Path] | None, typer.Option(metavar="DIR", help="Finished data set. Repeatable.")] = None,
    pairs: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="JSON list of map pairs with their truth. Whole families of worlds, of these and of the data sets, "
            "are then kept for the check. Repeatable.",
        ),
    ] = None,
    check_dataset: Annotated[
        list[Path] | None,
        typer.Option(metavar="DIR", help="Data set of other worlds to check on; default: the same. Repeatable."),
    ] = None,
    split: Annotated[
        str | None, typer.Option(help="Split to fit on.", show_default="train, or all with --check-dataset or --pairs")
    ] = None,
    check: Annotated[
        str | None, typer.Option(help="Split to check on.", show_default="test, or all with --check-dataset")
    ] = None,
    method: Annotated[str, typer.Option(help="Method whose confidence is fitted.")] = "quilt",
    limit: Annotated[
        int | None,
        typer.Option(help="Greatest number of pairs to fit on, and to check on, sampled evenly; default: all."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the sample and of the method.")] = 0,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
) -> int:
    """Fit the merger's confidence to generated pairs, and check it on held-out worlds.

    Prints the fitted settings of acceptance, and writes them with the reliability diagram of the check. The fit is
    repeated without each family of worlds and each subset, and checked on that; the table has the worst first.

    Example: mapquilt calibrate --dataset data --out calibration
    """
    spare_inputs(out, [*(dataset or ()), *(pairs or ()), *(check_dataset or ())])
    refuse_foreign(out, CALIBRATION_FILE)
    chosen = _chosen_split(dataset or [], pairs or [], check_dataset or [], split, check)
    work = unfinished_folder(out)
    with Runner(chosen_workers(workers, scheduler)) as runner:
        fitted_on, checked_on, others = (
            _answers(some, method, limit, seed, runner, work / name)
            for name, some in zip(JOBS, (chosen.fit, chosen.check, chosen.mixed), strict=True)
        )
    fitted = fit_acceptance(fitted_on)
    checked = calibration(decide_again(checked_on, fitted))
    if checked is None:
        raise ValueError("calibrate: no pair of the check has a reliable truth")
    held_out = hold_out_each(fitted_on, [*fitted_on, *checked_on, *others])
    with atomic_folder(out, ledger=True) as folder:
        write_record(folder / CALIBRATION_FILE, "calibration", acceptance_record(fitted, checked, held_out))
        (folder / RELIABILITY_PICTURE).write_bytes(figure_png(reliability_figure([checked])))
    for job in JOBS:
        remove_job(work / job, TASKS_FILE)
    if not any(work.iterdir()):
        work.rmdir()
    print_table(", ".join(f"{name} {getattr(fitted, name):.2f}" for name in FITTED))
    if chosen.check_worlds:
        print_table(
            f"checked on {', '.join(chosen.check_worlds)}; "
            f"{counted(len(chosen.mixed), 'pair')} of one world of either side held out only"
        )
    if held_out:
        print_table(held_out_table(held_out))
    print_table(
        f"{out}: on {counted(checked.pairs, 'pair')} of the check: expected calibration error {checked.ece:.3f}, "
        f"Brier {checked.brier:.3f} (of the base rate {checked.base_brier:.3f}), AUC {number_text(checked.auc, 3)}"
    )
    return 0


def _chosen_split(
    dataset: Sequence[Path],
    lists: Sequence[Path],
    check_dataset: Sequence[Path],
    split: str | None,
    check: str | None,
) -> WorldSplit:
    if not dataset and not lists:
        raise ValueError("no pairs to fit on: give --dataset DIR or --pairs FILE")
    if lists and check and not check_dataset:
        raise ValueError(f"--check {check}: with --pairs, worlds are kept for the check; leave it out")
    if common := {path.resolve() for path in dataset} & {path.resolve() for path in check_dataset}:
        raise ValueError(f"--check-dataset {min(common)}: is also fitted on; leave it out to check on another split")
    if not check_dataset and not lists:
        check_dataset, split, check = dataset, split or "train", check or "test"
        if split == check:
            raise ValueError(f"--check {check}: is the split of the fit, must be another")
    fit = [pair for folder in dataset for pair in dataset_pairs(folder, split)]
    fit += [pair for path in lists for pair in read_pair_list(path)]
    if not check_dataset:
        return split_by_world(fit)
    return WorldSplit(tuple(fit), tuple(pair for folder in check_dataset for pair in dataset_pairs(folder, check)))


def _answers(
    pairs: Sequence[BenchmarkPair], method: str, limit: int | None, seed: int, runner: Runner, work: Path
) -> list[EvaluatedPair]:
    if not pairs:
        return []
    if limit is not None:
        pairs = even_sample(pairs, limit, stream(seed, Role.BENCHMARK_SAMPLE))
    with count_progress(f"pairs to {work.name}") as on_progress:
        return list(run_benchmark(pairs, (MergeSettings(method),), seed, runner, on_progress, work))


def acceptance_record(fitted: AcceptanceSettings, checked: Calibration, held_out: Sequence[HeldOut]) -> dict[str, Any]:
    """Build the content of calibration.json; schema ``calibration``."""
    return {
        "schema": SCHEMA,
        "acceptance": dataclasses.asdict(fitted),
        "check": calibration_record(checked),
        "held_out": [dataclasses.asdict(one) for one in held_out],
    }


def held_out_table(rows: Sequence[HeldOut]) -> Table:
    """Tabulate the calibration on worlds and subsets that the fit did not see, in the order of ``rows``."""
    names = ("pairs", "accepted", "wrong", "ECE", "AUC")
    table = plain_table(("held out", False), ("name", False), *((name, True) for name in names))
    for row in rows:
        counts = (row.accepted, row.wrong_accepts)
        table.add_row(
            row.group,
            row.name,
            str(row.pairs),
            *(number_text(count, 0) for count in counts),
            *(number_text(score, 3) for score in (row.ece, row.auc)),
        )
    return table
