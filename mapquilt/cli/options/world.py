"""Define the options that name a world."""

from __future__ import annotations

from typing import Annotated

import typer

WorldName = Annotated[
    str, typer.Argument(metavar="WORLD", help="Family, world file (JSON, YAML), or floor plan (PNG, PGM, YAML).")
]
Width = Annotated[float | None, typer.Option(help="Width of a family's world [m].")]
Height = Annotated[float | None, typer.Option(help="Height of a family's world [m].")]
PlanResolution = Annotated[float | None, typer.Option(help="Resolution of a floor plan picture [m/pixel].")]
