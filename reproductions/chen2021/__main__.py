"""``python -m reproductions.chen2021``."""

from __future__ import annotations

import sys

import typer

from mapquilt.cli.entry import run_app
from reproductions.chen2021.command import thesis

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
app.command()(thesis)

if __name__ == "__main__":
    sys.exit(run_app(app, sys.argv[1:], "chen2021"))
