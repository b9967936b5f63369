"""Define the options that name a world."""

from __future__ import annotations

from typing import Annotated

import typer

WorldName = Annotated[
    str,
    typer.Argument(
        metavar="WORLD",
        help="Family, world file (JSON, YAML), or plan: a picture, map_server YAML, Open-RMF building.yaml, JSON of "
        "HouseExpo or AMRL, SVG, DXF, Gazebo SDF.",
    ),
]
Width = Annotated[float | None, typer.Option(help="Width of a family's world [m].")]
Height = Annotated[float | None, typer.Option(help="Height of a family's world [m].")]
PlanResolution = Annotated[
    float | None, typer.Option(help="Resolution of a picture or SVG [m/pixel], or unit of a DXF drawing [m].")
]
Level = Annotated[str | None, typer.Option(help="Level of a building.yaml; default: its only one.")]
FromMap = Annotated[
    bool,
    typer.Option(
        "--from-map",
        help="Mend a plan of a real place: drop specks, fill what robots cannot reach, join cells if there are too "
        "many, and say so.",
    ),
]
