"""Define the options of a merge."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from mapping.numbers import parse_angle, parse_number
from mapquilt.cli.options.workers import chosen_workers
from mapquilt.jobs.runner import Workers
from merge.fusion import FUSIONS
from merge.records.prior import SIGMA, Prior
from merge.settings import MergeSettings

SERIAL_MAPS = 6
"""Up to this many maps, starting workers takes longer than it saves."""

PRELOADED = ("merge.multimap.pair_selection",)
"""Modules that workers need."""

SCALE_HELP = "known, free (0.5 to 2), LO:HI, or auto: known if every resolution can be trusted."

ScaleOption = Annotated[str | None, typer.Option(help=SCALE_HELP, show_default="auto")]
ReferenceOption = Annotated[
    str | None,
    typer.Option("--reference", metavar="NAME", help="Map whose frame the answer is in; default: the first."),
]
FusionOption = Annotated[
    str | None,
    typer.Option(
        help=f"Rule for cells that several maps observed: {', '.join(FUSIONS)}.", show_default=MergeSettings.fusion
    ),
]
ElasticOption = Annotated[
    bool,
    typer.Option(
        "--elastic",
        help="Bend the maps of a group until their walls fall together, and fuse them then; see elastic.png. "
        "Transforms and verdicts stay. Maps that fit as they are stay too. Of logs, the poses of all robots are "
        "optimised in one graph, and their maps drawn anew.",
    ),
]
PriorOption = Annotated[
    list[str] | None,
    typer.Option(
        "--prior",
        metavar="NAME:X,Y,YAW[,SIGMA]",
        help="Approximate pose of a map's frame, X and Y [m] and YAW such as 90deg or 1.57 [rad], in a frame common to "
        "all priors; a single one is in the frame of --reference, or of the first other map. SIGMA is its uncertainty "
        f"[m, default {SIGMA:g}]. Repeatable.",
    ),
]
TrustOption = Annotated[
    bool,
    typer.Option(
        "--trust-priors",
        help="Stitch the maps at their --prior poses without verification. A map without one lies at 0,0,0: maps that "
        "share a frame need none.",
    ),
]


def parse_priors(texts: Sequence[str]) -> tuple[Prior, ...]:
    """Parse the ``--prior`` options. Raises ``ValueError`` with the option that is malformed."""
    return tuple(_parse_prior(text) for text in texts)


def _parse_prior(text: str) -> Prior:
    name, colon, numbers = text.rpartition(":")
    parts = numbers.split(",")
    if not (name and colon and len(parts) in (3, 4)):
        raise ValueError(f"--prior {text}: must be NAME:X,Y,YAW or NAME:X,Y,YAW,SIGMA, with YAW such as 90deg")
    try:
        x, y = (parse_number(part) for part in parts[:2])
        return Prior(name, x, y, parse_angle(parts[2]), *(parse_number(part) for part in parts[3:]))
    except ValueError as error:
        raise ValueError(f"--prior {text}: {error}") from None


def pair_workers(maps: int, workers: int | None, scheduler: str | None) -> Workers:
    """Choose the workers that match pairs: without ``--workers``, this process for a few maps, else one per core."""
    return chosen_workers(workers, scheduler, default=1 if maps <= SERIAL_MAPS else None, preload=PRELOADED)
