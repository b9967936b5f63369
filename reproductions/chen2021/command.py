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
from reproductions.chen2021.make import make_study
from reproductions.chen2021.table import terminal_table
from reproductions.chen2021.tally import tallies


def thesis(
    out: Annotated[Path, typer.Option(help="Folder to write; an unfinished study continues.")],
    seeds: Annotated[int, typer.Option(help="Pairs of maps per case.")] = 20,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
) -> int:
    """Reproduce chapters 3 to 6 of Chen (2021), with tables beside the values of the thesis, and pictures.

    An answer is right within 10 cells, 5 degrees and 5 % of scale. After an interruption the same command continues,
    and with more seeds it adds what is missing. See docs/thesis.md. Example: python -m reproductions.chen2021 --out
    thesis --seeds 2
    """
    with (
        Runner(chosen_workers(workers, scheduler)) as runner,
        count_progress("places and seeds, with all their answers") as on_progress,
    ):
        study = make_study(seeds, out, runner, on_progress)
    counted = tallies(study.answers)
    with count_progress("pictures") as on_progress:
        write_study(out, study, counted, on_progress)
    print_table(terminal_table(counted))
    print_table(f"{out}: {len(study.answers)} answers; see {out / TABLE_FILE}")
    return 0
