"""Lines below the table of a merge: transforms to paste, files, and what to try after a refusal."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from mapping.map_set import MapSet
from mapquilt.cli.tables import PLAIN_WIDTH
from mapquilt.merging.merge_inputs import INPUTS
from mapquilt.merging.transforms_file import pasted_transforms
from mapquilt.runs import folder as run_folder
from mapquilt.viz.refused_picture import pairs_to_show, separate_pairs
from merge.records.result import MergeResult
from merge.records.verdict import Reason

MOST_TRANSFORMS = 4
"""Number of transforms that are printed; of more, only the file is named."""

_PRIOR = "--prior NAME:X,Y,YAW"
ADVICE: Mapping[Reason, str] = MappingProxyType(
    {
        Reason.NOTHING_PROPOSED: "check that the maps show one place, or search other scales: --scale free",
        Reason.LITTLE_STRUCTURE: f"map more walls, or say where a map lies: {_PRIOR}",
        Reason.PARALLEL_WALLS: f"map a crossing or a room that both robots see, or say where a map lies: {_PRIOR}",
        Reason.LITTLE_OVERLAP: f"map more ground that both robots see, or say where a map lies: {_PRIOR}",
        Reason.FREE_SPACE_VIOLATION: "check that the maps show one place at one time, without drift",
        Reason.AMBIGUOUS: f"look at the two placements, and say where a map lies: {_PRIOR}",
        Reason.IMPRECISE: "map more ground that both robots see, or accept less: --min-confidence 0.5",
        Reason.OTHER_SCALE: "--scale free, or correct `resolution` in the YAML",
        Reason.OUTSIDE_SCALES: "search other scales: --scale LO:HI",
        Reason.MIRRORED: "flip one of the two pictures",
        Reason.CONTRADICTS_PRIOR: "check the pose and the yaw [rad] of --prior, or widen its SIGMA",
        Reason.CONTRADICTS_TEAM: "look for a map that is bent or of another place, and leave it out",
        Reason.NO_PREDICTED_OVERLAP: "map more ground that both robots see",
        Reason.NOT_SELECTED: "merge the two maps alone, or --set multimap.selection.partners=10",
        Reason.LOW_CONFIDENCE: "ask for less: --min-confidence",
        Reason.NO_PUBLISHED_ANSWER: "leave out --as-published, or take another --method",
        Reason.PUBLISHED_RULE: "leave out --as-published, or take another --method",
    }
)
"""What to try after a refusal, by its reason."""


def transform_notes(maps: MapSet, result: MergeResult) -> str:
    """Write the transforms as people paste them; of a large team, name the file that has them."""
    transforms = pasted_transforms(maps, result)
    if len(transforms) > MOST_TRANSFORMS:
        return f"{len(transforms)} transforms, in {run_folder.TRANSFORMS_FILE} and with --json"
    return "\n\n".join(transforms)


def advice(result: MergeResult, folder: Path | None) -> tuple[str, ...]:
    """Say what to try for maps that were not joined: once for each reason, and the picture to look at."""
    reasons = dict.fromkeys(pair.reason for pair in separate_pairs(result) if pair.reason is not None)
    tips = [f"{reason.value.replace('_', ' ')}: {ADVICE[reason]}" for reason in reasons]
    if folder is not None and pairs_to_show(result):
        tips.append(f"see the candidates and the runners-up in {folder / run_folder.REFUSED_PICTURE}")
    return tuple(tips)


def files_note(folder: Path | None, written: Sequence[Path]) -> str:
    """Name each file that was written; the copies of the maps by their folder."""
    if folder is None:
        return "nothing was written; --out DIR writes the merged map, the transforms and pictures"
    copies = [path for path in written if path.is_relative_to(folder / INPUTS)]
    names = [str(path.relative_to(folder)) for path in written if path not in copies]
    if copies:
        names.append(f"{INPUTS}/ ({len(copies)} files, copies of the maps)")
    listed = ", ".join(names)
    return textwrap.fill(
        f"written to {folder}: {listed}",
        PLAIN_WIDTH,
        subsequent_indent="  ",
        break_long_words=False,
        break_on_hyphens=False,
    )
