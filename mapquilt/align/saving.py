"""Save an arrangement: the files of a merge, and who decided each placement."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from mapping.io.map_file import map_files
from mapquilt.align.arrangement import Solved
from mapquilt.align.merge_command import repeat_command
from mapquilt.align.workspace import Workspace
from mapquilt.convert.reframing import Reframing, on_cells_of
from mapquilt.json_file import record_bytes, similarity_record
from mapquilt.merging.merge_folder import merge_run, with_unit, write_merge
from mapquilt.merging.transforms_file import pasted_transforms, transforms_text
from mapquilt.runs import folder as run_folder

SCHEMA = "mapquilt-align/1"


def align_record(workspace: Workspace, solved: Solved, frame_of: int | None = None) -> dict[str, Any]:
    """Build the content of align.json: for each map, who decided where it lies, its prior and its pose.

    ``frame_of`` is the map in whose frame the merged map is written once more.
    """
    priors = {prior.name: prior for prior in solved.settings.priors}
    placed, maps = solved.result.reference_from_map, workspace.maps
    entries = []
    for name, placement in zip(maps.names, workspace.arrangement.placements, strict=True):
        prior, pose = priors.get(name), placed.get(name)
        decided = placement.decided_by if prior is not None else "automatic"
        entries.append(
            {
                "name": name,
                "decided_by": "reference" if name == solved.settings.reference else decided,
                "prior": None if prior is None else [prior.x, prior.y, prior.yaw, prior.sigma],
                "reference_from_map": None if pose is None else similarity_record(pose),
            }
        )
    return {
        "schema": SCHEMA,
        "reference": solved.result.reference,
        "verified": not solved.settings.trust_priors,
        "maps": entries,
        "in_frame_of": None if frame_of is None else maps.names[frame_of],
        "command": command(workspace, solved),
    }


def command(workspace: Workspace, solved: Solved) -> str:
    """Write the command that repeats a merge. That of an older merge writes beside it, not over its inputs."""
    task, settings, out = workspace.task, solved.settings, str(workspace.task.folder)
    if run_folder.is_run(task.folder):
        return repeat_command(task.sources, settings, task.seed, None, None)
    if task.source_names is not None:
        named = dict(zip(workspace.maps.names, task.source_names, strict=True))
        priors = tuple(replace(prior, name=named[prior.name]) for prior in settings.priors)
        reference = None if settings.reference is None else named[settings.reference]
        settings, out = replace(settings, priors=priors, reference=reference), f"{out}-again"
    return repeat_command(task.sources, settings, task.seed, task.inputs.unknown[0], out)


def save(
    workspace: Workspace, solved: Solved, *, yaw_zero: bool = False, frame_of: int | None = None
) -> tuple[Path, ...]:
    """Write all files of a merge and align.json, or none, and return their paths.

    All but align.json equal those that ``mapquilt merge`` writes with the same priors. With ``yaw_zero``, the merged
    map is written once more on a raster without a yaw, for readers that ignore it; with ``frame_of``, once more in the
    frame and on the cells of that map.

    Raises ``ValueError`` if that map was left out, or would need too many cells.
    """
    task, maps, result = workspace.task, workspace.maps, solved.result
    path = task.folder / run_folder.ALIGN_FILE
    further = {path: record_bytes(path, "align", align_record(workspace, solved, frame_of))}
    if yaw_zero:
        upright = map_files(Reframing(yaw=0.0).apply(result.merged), task.folder / run_folder.YAW_ZERO_NAME)
        further |= with_unit(upright, maps.units[maps.names.index(result.reference)], result.reference)
    if frame_of is not None:
        name = maps.names[frame_of]
        if name not in result.reference_from_map:
            raise ValueError(f"{name}: was left out of the merge; choose the frame of a map that was joined")
        merged = on_cells_of(result.merged, result.reference_from_map[name].inverse(), maps.grids[frame_of].frame)
        framed = map_files(merged, task.folder / run_folder.IN_FRAME_NAME)
        further |= with_unit(framed, maps.units[frame_of], name)
    if run_folder.is_run(task.folder):
        _, written = merge_run(task.folder, solved.settings, task.seed, inputs=task.inputs, further=further)
        return written
    return write_merge(task.folder, task.inputs, solved.settings, task.seed, solved.result, further)


def exports(workspace: Workspace, solved: Solved) -> dict[str, str]:
    """Write the transforms of a merge as people paste them, by the title of each form."""
    return {
        "tf": "\n\n".join(pasted_transforms(workspace.maps, solved.result)),
        "yaml": transforms_text(workspace.maps, solved.result),
        "json": json.dumps(align_record(workspace, solved), indent=2, ensure_ascii=False),
        "command": command(workspace, solved),
    }
