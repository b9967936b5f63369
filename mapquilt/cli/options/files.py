"""Define arguments and options that name files and folders."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def path(text: str) -> Path:
    """Parse the name of an output. Refuse an empty one, such as an unset variable: it would mean the current folder."""
    if not text:
        raise typer.BadParameter("the name is empty")
    return Path(text)


Out = Annotated[Path, typer.Option("--out", parser=path, help="Run folder to write; an older run there is replaced.")]
RunFolder = Annotated[Path, typer.Argument(metavar="RUN", help="Run folder that `simulate` or `sense` wrote.")]
Unknown = Annotated[
    int | None,
    typer.Option(min=0, max=255, help="Grey level of map files that means unknown; default: as in the files."),
]
