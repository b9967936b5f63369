"""``mapquilt align``: a page to align maps by hand."""

from __future__ import annotations

import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from mapping.geometry.scale_range import ScaleRange
from mapquilt.align.open_task import open_task
from mapquilt.align.workspace import Workspace
from mapquilt.cli.options.files import Unknown, path, unknown_grey
from mapquilt.cli.options.merge import ScaleOption
from mapquilt.cli.tables import warn
from mapquilt.jobs.progress import count_progress


def align(
    maps: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN | MERGE | MAP...",
            help="A run, the folder of a merge, or maps: map_server YAML, PGM or PNG, or logs of robots to map first.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            parser=path,
            help="New folder, or one of an older merge, that the page saves to; a run or a merge stores it itself. "
            "[default: aligned]",
        ),
    ] = None,
    scale: ScaleOption = None,
    unknown: Unknown = None,
    seed: Annotated[int, typer.Option(help="Seed of the method's random samples.")] = 0,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of the page on 127.0.0.1; 0: a free one.")] = 0,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Print the address of the page, and do not open it.")
    ] = False,
) -> int:
    """Align maps by hand on a page in the browser, snap them, and save the merge.

    The page is served on this machine alone, until Ctrl-C or its button Quit.

    Example: mapquilt align floor_a.yaml floor_b.yaml --out aligned
    """
    with align_extra():
        from mapquilt.align.server import AlignServer  # here: the packages are an extra
    searched = None if scale is None else ScaleRange.parse(scale)
    with count_progress("mapping logs") as on_progress:
        task = open_task(maps, out, unknown_grey(unknown), searched, seed, on_progress)
    warn(task.inputs.warnings)
    server = AlignServer(Workspace(task), port)
    typer.echo(f"align the maps on {server.address}\nCtrl-C ends the page; Save writes to {task.folder}")
    if not no_browser:
        webbrowser.open(server.address)
    try:
        server.run()
    except KeyboardInterrupt:  # the usual way to end the page
        return 0
    return 0


@contextmanager
def align_extra() -> Iterator[None]:
    """Import what needs the server in this block. Raises ``ImportError`` with the way to install it."""
    try:
        yield
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] not in ("starlette", "uvicorn"):
            raise
        raise ImportError(
            "mapquilt align needs the packages starlette and uvicorn: pip install 'mapquilt[align]'"
        ) from None
