"""``python -m reproductions.chen2021``: reproduce the study of Chen 2021."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mapquilt.cli.options.workers import SchedulerOption, WorkersOption, chosen_workers
from mapquilt.cli.tables import print_table
from mapquilt.jobs.progress import count_progress
from mapquilt.jobs.runner import Runner
from reproductions.chen2021.files import TABLE_FILE, write_study
from reproductions.chen2021.make import StudySpec, make_study
from reproductions.chen2021.methods import study_methods
from reproductions.chen2021.table import terminal_table
from reproductions.chen2021.tally import tallies, true_overlaps


def thesis(
    out: Annotated[Path, typer.Option(help="Folder to write; an unfinished study continues.")],
    seeds: Annotated[int, typer.Option(help="Number of missions and maps per case.")] = 20,
    method: Annotated[
        list[str] | None,
        typer.Option(
            help=f"Method: {', '.join(each.title for each in study_methods())}. Repeatable; default: all of them."
        ),
    ] = None,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
) -> int:
    """Reproduce chapters 3 to 6 of Chen (2021), with tables beside the values of the thesis, and pictures.

    An answer is right within 10 cells, 5 degrees and 5 % of scale. After an interruption the same command continues.
    See docs/thesis.md. Example: python -m reproductions.chen2021 --out thesis --seeds 2
    """
    spec = StudySpec(seeds) if method is None else StudySpec(seeds, tuple(method))
    with (
        Runner(chosen_workers(workers, scheduler)) as runner,
        count_progress("missions with all their answers") as on_progress,
    ):
        study = make_study(spec, out, runner, on_progress)
    counted = tallies(study, true_overlaps(out, spec.seeds))
    with count_progress("pictures") as on_progress:
        write_study(out, study, counted, on_progress)
    print_table(terminal_table(counted))
    print_table(f"{out}: {len(study.answers)} answers; see {out / TABLE_FILE}")
    return 0
