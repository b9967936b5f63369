"""Intermediate steps of the method ``morphology``: ``mapquilt merge --method morphology --debug DIR``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from mapping.io.transaction import atomic_folder
from mapping.map_set import MapSet
from mapquilt.jobs.progress import count_progress
from mapquilt.json_file import write_record
from mapquilt.runs.folder import is_run, refuse_foreign, spare_inputs
from merge.settings import MergeSettings

if TYPE_CHECKING:
    from mapquilt.merging.morphology_steps import TeamSteps

METHOD = "morphology"
RECORD_FILE = "steps.json"
SHEET_PICTURE = "steps.png"
DIRECTION_PICTURE = "3-direction.png"


def refuse_debug(out: Path, settings: MergeSettings, sources: Sequence[Path]) -> None:
    """Raise ``ValueError`` if the method has no steps to show, or if the folder holds other files."""
    if settings.method != METHOD:
        raise ValueError(f"--debug {out}: only --method {METHOD} has steps to show, not {settings.method}")
    if is_run(out):
        raise ValueError(f"{out}: is a run; choose another folder")
    spare_inputs(out, sources)
    refuse_foreign(out, RECORD_FILE)


def show_steps(maps: MapSet, settings: MergeSettings, debug: Path | None) -> tuple[str, ...]:
    """Return warnings on maps without a main direction; with a folder ``debug``, write all steps there."""
    from mapquilt.merging.morphology_steps import corrected_maps, notes, team_steps

    if debug is None:
        return notes(maps.names, corrected_maps(maps.grids))
    team = team_steps(maps, settings.scale or maps.scale_range)
    with count_progress("pictures of steps") as on_progress:
        write_debug(debug, team, on_progress)
    return notes(team.names, team.maps)


def write_debug(out: Path, team: TeamSteps, on_progress: Callable[[int, int], None]) -> None:
    """Write pictures of each step of each map, the corner matches of each pair, an overview, and steps.json.

    The folder is written atomically; an older one is replaced.
    """
    from mapquilt.merging.morphology_steps import steps_record
    from mapquilt.merging.step_pictures import direction_figure, match_figure, picture_png, sheet_figure, step_pictures
    from mapquilt.viz.png import figure_png

    refuse_foreign(out, RECORD_FILE)
    total = len(team.maps) + len(team.pairs)
    with atomic_folder(out, ledger=True) as folder:
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
