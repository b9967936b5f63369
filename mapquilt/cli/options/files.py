"""Define arguments and options that name files and folders."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mapping.io.map_file import UnknownGrey


def path(text: str) -> Path:
    """Parse the name of an output. Refuse an empty one, such as an unset variable: it would mean the current folder."""
    if not text:
        raise typer.BadParameter("the name is empty")
    return Path(text)


Out = Annotated[Path, typer.Option("--out", parser=path, help="Run folder to write; an older run there is replaced.")]
RunFolder = Annotated[Path, typer.Argument(metavar="RUN", help="Run folder that `simulate` or `sense` wrote.")]
Unknown = Annotated[
    str | None,
    typer.Option(
        metavar="GREY",
        help="Grey level of map files that means unknown, 0 to 255, or none: the thresholds decide; default: as in the "
        "files, and 205 in those of the ROS 2 saver.",
    ),
]


def unknown_grey(text: str | None) -> UnknownGrey:
    """Parse ``--unknown``. Raises ``ValueError`` naming the text."""
    if text is None or text == "none":
        return None if text is None else "none"
    if text.isdecimal() and int(text) <= 255:
        return int(text)
    raise ValueError(f"--unknown {text}: must be a grey level from 0 to 255, or none")
