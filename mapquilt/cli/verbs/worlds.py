"""``mapquilt worlds``: list, draw and write worlds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
import yaml

from mapping.io.atomic import write_bytes_atomically
from mapping.io.picture import Picture, picture_bytes
from mapping.seeds import Role, stream
from mapping.wording import counted
from mapquilt.cli.application import new_app
from mapquilt.cli.options.mission import SEED
from mapquilt.cli.options.world import FromMap, Height, Level, PlanResolution, Width, WorldName
from mapquilt.cli.tables import print_table, warn
from mapquilt.json_file import check_record, to_text
from mapquilt.runs.open_world import YAMLS, open_world
from mapquilt.viz.text_table import plain_table
from mapquilt.viz.world_picture import sheet_picture, world_picture
from sim.mission.starts import random_starts
from worlds.drafting.drafting import draft_plan
from worlds.drafting.style import STYLES
from worlds.families.registry import FAMILIES
from worlds.importing.plan_file import PlanOptions
from worlds.world_file import world_to_json

worlds_app = new_app(
    help="List, draw and write the places that robots can explore.\n\nExample: mapquilt worlds show warehouse --seed 3"
)

Seed = Annotated[int, typer.Option(help="Seed of the world, as for `simulate`.")]


@worlds_app.command("list")
def list_worlds() -> None:
    """List the families of worlds with their default sizes.

    Example: mapquilt worlds list
    """
    table = plain_table(("world", False), ("size [m]", True), ("what it is", False))
    for name, family in FAMILIES.items():
        table.add_row(name, f"{family.width:g} x {family.height:g}", family.about)
    print_table(table)


@worlds_app.command()
def show(
    world: WorldName,
    seed: Seed = SEED,
    robots: Annotated[int, typer.Option(min=0, help="Number of starts to draw, chosen as by `simulate`.")] = 3,
    width: Width = None,
    height: Height = None,
    plan_resolution: PlanResolution = None,
    level: Level = None,
    from_map: FromMap = False,
    out: Annotated[Path | None, typer.Option(help="PNG to write; default: WORLD-SEED.png.")] = None,
) -> None:
    """Draw a world with its dimensions and the robots' starts.

    Example: mapquilt worlds show warehouse --seed 3, or mapquilt worlds show lab.yaml --from-map
    """
    opened, notes = open_world(world, seed, width, height, PlanOptions(plan_resolution, level, from_map))
    warn(notes)
    starts = random_starts(stream(seed, Role.STARTS), opened, robots) if robots else ()
    path = Path(f"{opened.name}-{seed}.png") if out is None else out
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(path, world_picture(opened, starts, seed))
    print_table(
        f"{path}: {opened.name}, {opened.size[0]:g} x {opened.size[1]:g} m, {counted(len(opened.obstacles), 'solid')}"
    )


@worlds_app.command()
def make(
    world: WorldName,
    out: Annotated[Path, typer.Option("--out", help="World file to write: .json, .yaml or .yml.")],
    seed: Seed = SEED,
    width: Width = None,
    height: Height = None,
    plan_resolution: PlanResolution = None,
    level: Level = None,
    from_map: FromMap = False,
) -> None:
    """Write a world to a file that can be edited and that `simulate` reads.

    Example: mapquilt worlds make house --seed 5 --out house.json, or make lab.yaml --from-map --out lab.json
    """
    if out.suffix.lower() not in (".json", *YAMLS):
        raise ValueError(f"--out {out}: a world file ends in .json, .yaml or .yml")
    opened, notes = open_world(world, seed, width, height, PlanOptions(plan_resolution, level, from_map))
    warn(notes)
    record = world_to_json(opened)
    check_record(out, "world", record)
    is_yaml = out.suffix.lower() in YAMLS
    text = yaml.safe_dump(record, sort_keys=False, default_flow_style=None) if is_yaml else to_text(record)
    out.parent.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(out, text.encode())
    print_table(
        f"{out}: {opened.name}, {opened.size[0]:g} x {opened.size[1]:g} m, {counted(len(opened.obstacles), 'solid')}"
    )


@worlds_app.command()
def draft(
    world: WorldName,
    out: Annotated[Path, typer.Option("--out", help="PNG to write.")],
    style: Annotated[str, typer.Option(help=f"Style of the drawing: {', '.join(STYLES)}.")] = "hollow",
    drawing: Annotated[int, typer.Option(help="Seed of the drawing's details: scale, lines, furniture, text.")] = 0,
    seed: Seed = SEED,
    width: Width = None,
    height: Height = None,
) -> None:
    """Draw a world as an architect draws a floor plan, to try `locate` with.

    Example: mapquilt worlds draft office --seed 3 --style hatched --out plan.png
    """
    if out.suffix.lower() != ".png":
        raise ValueError(f"--out {out}: must end in .png")
    opened, notes = open_world(world, seed, width, height)
    warn(notes)
    plan = draft_plan(opened, style, drawing)
    out.parent.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(out, picture_bytes(Picture(plan.grey), "png"))
    rows, cols = plan.grey.shape
    print_table(f"{out}: {opened.name}, {style}, {cols} x {rows} pixels of {plan.frame.resolution:.4g} m")


@worlds_app.command()
def sheet(
    out: Annotated[Path, typer.Option("--out", help="PNG to write.")] = Path("worlds.png"),
    seed: Seed = SEED,
) -> None:
    """Draw one world of each family on one sheet.

    Example: mapquilt worlds sheet --out worlds.png
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(out, sheet_picture(seed))
    print_table(f"{out}: {len(FAMILIES)} worlds, seed {seed}")
