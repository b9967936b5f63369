"""``mapquilt calibrate``: fit the constants of the acceptance rule."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from mapping.io.transaction import atomic_folder
from mapping.seeds import Role, stream
from mapping.wording import counted
from mapquilt.benchmark.files import RELIABILITY_PICTURE, calibration_record
from mapquilt.benchmark.fitting import FITTED, decide_again, fit_acceptance
from mapquilt.benchmark.pair_sets import dataset_pairs, even_sample
from mapquilt.benchmark.trials import TASKS_FILE, run_benchmark, unfinished_folder
from mapquilt.cli.options.workers import SchedulerOption, WorkersOption, chosen_workers
from mapquilt.cli.tables import print_table
from mapquilt.evaluation.calibration import Calibration, calibration
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.jobs.journal import remove_job
from mapquilt.jobs.progress import count_progress
from mapquilt.jobs.runner import Runner
from mapquilt.json_file import write_record
from mapquilt.runs.folder import refuse_foreign, spare_inputs
from mapquilt.viz.png import figure_png
from mapquilt.viz.reliability import reliability_figure
from merge.settings import MergeSettings
from merge.verification.settings import AcceptanceSettings

SCHEMA = "mapquilt-calibration/2"
CALIBRATION_FILE = "calibration.json"


def calibrate(
    dataset: Annotated[list[Path], typer.Option(metavar="DIR", help="Finished data set. Repeatable.")],
    out: Annotated[Path, typer.Option(help="Folder to write; a calibration there is replaced.")],
    check_dataset: Annotated[
        list[Path] | None,
        typer.Option(metavar="DIR", help="Data set of other worlds to check on; default: the same. Repeatable."),
    ] = None,
    split: Annotated[
        str | None, typer.Option(help="Split to fit on.", show_default="train, or all with --check-dataset")
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

    Prints the fitted settings of acceptance, and writes them with the reliability diagram of the check.

    Example: mapquilt calibrate --dataset data --out calibration
    """
    if not check_dataset:
        check_dataset, split, check = dataset, split or "train", check or "test"
        if split == check:
            raise ValueError(f"--check {check}: is the split of the fit, must be another")
    elif common := {path.resolve() for path in dataset} & {path.resolve() for path in check_dataset}:
        raise ValueError(f"--check-dataset {min(common)}: is also fitted on; leave it out to check on another split")
    spare_inputs(out, [*dataset, *check_dataset])
    refuse_foreign(out, CALIBRATION_FILE)
    with Runner(chosen_workers(workers, scheduler)) as runner:
        work = unfinished_folder(out)
        fitted = fit_acceptance(_answers(dataset, split, method, limit, seed, runner, work / "fit"))
        checked_pairs = _answers(check_dataset, check, method, limit, seed, runner, work / "check")
    checked = calibration(decide_again(checked_pairs, fitted))
    if checked is None:
        raise ValueError(f"{check_dataset[0]}: has no pair with a reliable truth to check on")
    with atomic_folder(out, ledger=True) as folder:
        write_record(folder / CALIBRATION_FILE, "calibration", acceptance_record(fitted, checked))
        (folder / RELIABILITY_PICTURE).write_bytes(figure_png(reliability_figure([checked])))
    for job in (work / "fit", work / "check"):
        remove_job(job, TASKS_FILE)
    if not any(work.iterdir()):
        work.rmdir()
    print_table(", ".join(f"{name} {getattr(fitted, name):.2f}" for name in FITTED))
    auc = "-" if checked.auc is None else f"{checked.auc:.3f}"
    print_table(
        f"{out}: on {counted(checked.pairs, 'pair')} of the check: expected calibration error {checked.ece:.3f}, "
        f"Brier {checked.brier:.3f} (of the base rate {checked.base_brier:.3f}), AUC {auc}"
    )
    return 0


def _answers(
    dataset: Sequence[Path],
    split: str | None,
    method: str,
    limit: int | None,
    seed: int,
    runner: Runner,
    work: Path,
) -> list[EvaluatedPair]:
    pairs = [pair for folder in dataset for pair in dataset_pairs(folder, split)]
    if limit is not None:
        pairs = even_sample(pairs, limit, stream(seed, Role.BENCHMARK_SAMPLE))
    with count_progress(f"pairs to {work.name}") as on_progress:
        return run_benchmark(pairs, (MergeSettings(method),), seed, runner, on_progress, work)


def acceptance_record(fitted: AcceptanceSettings, checked: Calibration) -> dict[str, Any]:
    """Build the content of calibration.json; schema ``calibration``."""
    return {"schema": SCHEMA, "acceptance": dataclasses.asdict(fitted), "check": calibration_record(checked)}
