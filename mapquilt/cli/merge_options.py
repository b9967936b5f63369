"""What the command line says of a merge beyond the method."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Annotated

import typer

from mapquilt.jobs.executor import process_pool
from mapquilt.numbers import parse_number
from merge.fusion import FUSIONS
from merge.records.prior import SIGMA, Prior

SERIAL_MAPS = 6
"""Up to so many maps, starting workers takes longer than they save."""

PRELOADED = ("merge.multimap.pair_selection", "merge.multimap.guided_matching")
"""What workers are asked to do, and all that it needs."""

ReferenceOption = Annotated[
    str | None,
    typer.Option("--reference", metavar="NAME", help="Map whose frame the answer is in; default: the largest."),
]
FusionOption = Annotated[str, typer.Option(help=f"How cells that several maps know are joined: {', '.join(FUSIONS)}.")]
PriorOption = Annotated[
    list[str] | None,
    typer.Option(
        "--prior",
        metavar="NAME:X,Y,YAW[,SIGMA]",
        help="Where a map's frame roughly lies [m, rad] in a frame that all priors share, or, of one alone, in that of "
        f"--reference; and how far off it may be [m, default {SIGMA:g}]. Repeatable.",
    ),
]
WorkersOption = Annotated[
    int | None,
    typer.Option(min=1, help="Processes that match pairs; default: one a core for more than 6 maps, else none."),
]


def parse_priors(texts: Sequence[str]) -> tuple[Prior, ...]:
    """The priors that the options say. Raises ``ValueError`` naming the option that says none."""
    return tuple(_parse_prior(text) for text in texts)


def _parse_prior(text: str) -> Prior:
    name, colon, numbers = text.rpartition(":")
    parts = numbers.split(",")
    if not (name and colon and len(parts) in (3, 4)):
        raise ValueError(f"--prior {text}: must be NAME:X,Y,YAW or NAME:X,Y,YAW,SIGMA")
    try:
        return Prior(name, *(parse_number(part) for part in parts))
    except ValueError as error:
        raise ValueError(f"--prior {text}: {error}") from None


@contextmanager
def workers_for(maps: int, workers: int | None) -> Iterator[Executor | None]:
    """Where pairs are matched: in this process where that is quicker, else by so many of their own."""
    number = workers if workers is not None else (os.cpu_count() or 1 if maps > SERIAL_MAPS else 1)
    if number == 1:
        yield None
        return
    pool = process_pool(number, PRELOADED)
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)
