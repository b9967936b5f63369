"""``mapquilt merge --method morphology --debug DIR``: every intermediate picture."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from mapping.io.atomic import atomic_folder
from mapquilt.json_file import write_record
from mapquilt.merging.debug import RECORD_FILE
from mapquilt.merging.morphology_steps import TeamSteps, steps_record
from mapquilt.runs.folder import refuse_foreign
from mapquilt.viz.png import figure_png
from mapquilt.viz.step_pictures import (
    direction_figure,
    match_figure,
    picture_png,
    sheet_figure,
    step_pictures,
)

SHEET_PICTURE = "steps.png"
DIRECTION_PICTURE = "3-direction.png"


def write_debug(out: Path, team: TeamSteps, on_progress: Callable[[int, int], None]) -> None:
    """Write a folder for each map with the picture of each step, the corner pairs of each pair, a sheet of all maps
    and their numbers; whole or not at all. An older one is replaced."""
    refuse_foreign(out, RECORD_FILE)
    total = len(team.maps) + len(team.pairs)
    with atomic_folder(out) as folder:
        for number, (name, each) in enumerate(zip(team.names, team.maps, strict=True)):
            place = folder / f"{number}-{Path(name).name}"
            place.mkdir()
            for step, picture in step_pictures(each.correction):
                (place / f"{step}.png").write_bytes(picture_png(picture))
            (place / DIRECTION_PICTURE).write_bytes(figure_png(direction_figure(name, each.correction)))
            on_progress(number + 1, total)
        for number, pair in enumerate(team.pairs):
            (folder / f"{pair.target}-{pair.source}-matches.png").write_bytes(figure_png(match_figure(team, pair)))
            on_progress(len(team.maps) + number + 1, total)
        sheet = sheet_figure(team.names, [each.correction for each in team.maps])
        (folder / SHEET_PICTURE).write_bytes(figure_png(sheet))
        write_record(folder / RECORD_FILE, "steps", steps_record(team))
