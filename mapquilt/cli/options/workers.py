"""Options that choose where the work of a verb runs."""

from __future__ import annotations

import os
from typing import Annotated

import typer

from mapquilt.jobs.runner import Workers

WorkersOption = Annotated[
    int | None, typer.Option("--workers", min=1, help="Number of processes; default: one per core.")
]
SchedulerOption = Annotated[
    str | None, typer.Option("--scheduler", help="Dask scheduler to run on instead, such as tcp://head:8786.")
]


def chosen_workers(
    workers: int | None, scheduler: str | None, default: int | None = None, preload: tuple[str, ...] = ()
) -> Workers:
    """Combine the options; without ``--workers``, ``default`` processes or one per core."""
    return Workers(workers or default or os.cpu_count() or 1, scheduler, preload)
