"""What ``mapquilt merge --method morphology`` tells besides the merge: warnings, and with ``--debug`` every picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mapping.map_set import MapSet
from mapquilt.jobs.progress import count_progress
from mapquilt.runs.folder import is_run, refuse_foreign
from merge.settings import MergeSettings

METHOD = "morphology"
RECORD_FILE = "steps.json"


def refuse_debug(out: Path, settings: MergeSettings, sources: Sequence[Path]) -> None:
    """Raise ``ValueError`` where there is nothing to show, or the folder holds what no ``--debug`` wrote."""
    if settings.method != METHOD:
        raise ValueError(f"--debug {out}: only --method {METHOD} has steps to show, not {settings.method}")
    if is_run(out):
        raise ValueError(f"{out}: is a run; name another folder")
    refuse_foreign(out, RECORD_FILE)


def show_steps(maps: MapSet, settings: MergeSettings, debug: Path | None) -> tuple[str, ...]:
    """Warnings on maps that have no main direction; with a folder ``debug`` the pictures and numbers of all steps."""
    from mapquilt.merging.morphology_steps import corrected_maps, notes, team_steps

    if debug is None:
        return notes(maps.names, corrected_maps(maps.grids))
    from mapquilt.merging.debug_folder import write_debug

    team = team_steps(maps, settings.scale or maps.scale_range)
    with count_progress("pictures of steps") as on_progress:
        write_debug(debug, team, on_progress)
    return notes(team.names, team.maps)
