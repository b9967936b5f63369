"""Lines below the table of a merge: transforms to paste, files, and what to try after a refusal."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path

from mapping.map_set import MapSet
from mapping.wording import counted
from mapquilt.cli.tables import PLAIN_WIDTH
from mapquilt.merging.merge_inputs import INPUTS
from mapquilt.merging.remedies import remedy
from mapquilt.merging.transforms_file import pasted_transforms
from mapquilt.runs import folder as run_folder
from mapquilt.viz.refused_picture import pairs_to_show, separate_pairs
from merge.records.result import MergeResult
from merge.settings import MergeSettings

MOST_TRANSFORMS = 4
"""Number of transforms that are printed; of more, only the file is named."""


def transform_notes(maps: MapSet, result: MergeResult) -> str:
    """Write the transforms as people paste them; of a large team, name the file that has them."""
    transforms = pasted_transforms(maps, result)
    if len(transforms) > MOST_TRANSFORMS:
        return f"{len(transforms)} transforms, in {run_folder.TRANSFORMS_FILE} and with --json"
    return "\n\n".join(transforms)


def advice(maps: MapSet, result: MergeResult, settings: MergeSettings, folder: Path | None) -> tuple[str, ...]:
    """Say what to try for maps that were not joined: once for each reason and remedy, and the picture to look at.

    Reasons are named, as the table names them, only if they differ.
    """
    refused = [pair for pair in separate_pairs(result) if pair.reason is not None]
    found = dict.fromkeys((str(pair.refusal), remedy(pair, maps, settings)) for pair in refused)
    several = len({reason for reason, _ in found}) > 1
    tips = [f"if {reason}: {text}" if several else text for reason, text in found]
    if folder is not None and pairs_to_show(result):
        tips.append(f"see the candidates and the runners-up in {folder / run_folder.REFUSED_PICTURE}")
    return tuple(tips)


def files_note(folder: Path | None, written: Sequence[Path], alone: str | None = None) -> str:
    """Name each file that was written; the copies of the maps by their folder.

    ``alone`` is the only map of the merged map, if none was merged with it.
    """
    if folder is None:
        return "nothing was written; --out DIR writes the merged map, the transforms and pictures"
    copies = [path for path in written if path.is_relative_to(folder / INPUTS)]
    names = [str(path.relative_to(folder)) for path in written if path not in copies]
    if alone is not None:
        names = [f"{name} ({alone} alone)" if name == f"{run_folder.MERGED_NAME}.pgm" else name for name in names]
    if copies:
        copied = len({path.relative_to(folder / INPUTS).parts[0] for path in copies})
        names.append(f"{INPUTS}/ ({'a copy' if copied == 1 else 'copies'} of {counted(copied, 'given map')})")
    listed = ", ".join(names)
    return textwrap.fill(
        f"written to {folder}: {listed}",
        PLAIN_WIDTH,
        subsequent_indent="  ",
        break_long_words=False,
        break_on_hyphens=False,
    )
