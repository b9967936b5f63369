"""Arguments and options that name files and folders."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def path(text: str) -> Path:
    """The name of what is to be written. An empty one, as of a variable that is not set, would be the folder that one
    is in."""
    if not text:
        raise typer.BadParameter("it names nothing")
    return Path(text)


Out = Annotated[
    Path, typer.Option("--out", parser=path, help="Run folder to write; a run of mapquilt's there is replaced.")
]
RunFolder = Annotated[Path, typer.Argument(metavar="RUN", help="Run folder that `simulate` or `sense` wrote.")]
Unknown = Annotated[
    int | None, typer.Option(min=0, max=255, help="Grey level of map files that means unknown, whatever they say.")
]
