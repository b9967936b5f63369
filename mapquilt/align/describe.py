"""Descriptions of the workspace as JSON, for the page."""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import coarsened
from mapquilt.align.measurement import Measured, combine_classes
from mapquilt.align.workspace import Workspace
from mapquilt.json_file import similarity_record
from mapquilt.merging.remedies import remedy
from mapquilt.viz.palette import map_colours
from merge.records.evidence import Evidence
from merge.records.result import PairResult
from merge.verification.acceptance import requirements
from merge.verification.settings import AcceptanceSettings

EVIDENCE = (
    "length of matched walls [cells]",
    "spread of their directions",
    "overlap of the known areas",
    "alignment score",
    "lead over the runner-up",
)
"""Titles of the evidence that ``requirements`` lists, in its order."""

MOST_CELLS = 4096
"""Cells a side of the largest map that the page draws cell by cell; a canvas of Chromium has at most 16,384."""


def shown_grid(grid: OccupancyGrid) -> OccupancyGrid:
    """Crop a map to its known part, in wider cells if it has too many."""
    grid = grid.cropped()
    times = math.ceil(max(grid.frame.shape) / MOST_CELLS)
    return coarsened(grid, times) if times > 1 else grid


def cell_bytes(grid: OccupancyGrid) -> bytes:
    """Encode the cells of a map, row by row from the lowest, one byte each: 0 unknown, 1 free, 2 occupied."""
    return np.where(grid.occupied, 2, np.where(grid.free, 1, 0)).astype(np.uint8).tobytes()


def maps_record(workspace: Workspace, shown: Sequence[GridFrame]) -> list[dict[str, Any]]:
    """Describe each map: its name, unit and colour, and the frame of the cells that the page draws."""
    maps = workspace.maps
    return [
        {
            "name": name,
            "unit": unit,
            "colour": colour,
            "resolution": frame.resolution,
            "origin": [frame.origin.x, frame.origin.y, frame.origin.yaw],
            "rows": frame.shape[0],
            "cols": frame.shape[1],
        }
        for name, unit, colour, frame in zip(maps.names, maps.units, map_colours(maps.names), shown, strict=True)
    ]


def start_record(workspace: Workspace, shown: Sequence[GridFrame]) -> dict[str, Any]:
    """Describe all that the page shows first: the maps with the frames of their shown cells, and the arrangement."""
    return {
        "maps": maps_record(workspace, shown),
        "scale_fixed": workspace.scale_range.fixed,
        "state": state_record(workspace),
    }


def state_record(workspace: Workspace) -> dict[str, Any]:
    """Describe the arrangement, and if it can be undone and redone."""
    arrangement = workspace.arrangement
    solved = None if arrangement.solved is None else arrangement.solved.result
    return {
        "reference": arrangement.reference,
        "placements": [
            {**similarity_record(each.sheet_from_map), "decided_by": each.decided_by} for each in arrangement.placements
        ],
        "undo": bool(workspace.history.past),
        "redo": bool(workspace.history.future),
        "solved": None if solved is None else solved_record(workspace, solved.pairs, solved.left_out),
    }


def solved_record(workspace: Workspace, pairs: Sequence[PairResult], left_out: Mapping[str, str]) -> dict[str, Any]:
    """Describe a merge: each pair with its verdict, and each map that was left out with the reason."""
    return {
        "pairs": [answer_record(workspace, pair) for pair in pairs],
        "left_out": [{"name": name, "reason": reason} for name, reason in left_out.items()],
    }


def answer_record(workspace: Workspace, answer: PairResult) -> dict[str, Any]:
    """Describe the answer of a pair: its verdict, how sure it is, and what to try after a refusal."""
    return {
        "target": answer.target,
        "source": answer.source,
        "accepted": answer.accepted,
        "confidence": answer.confidence,
        "reason": answer.reason_text,
        "try": None if answer.reason is None else remedy(answer, workspace.maps, workspace.task.settings),
        "evidence": [] if answer.evidence is None else _evidence(answer.evidence, workspace.task.settings.acceptance),
    }


def _evidence(evidence: Evidence, settings: AcceptanceSettings) -> list[dict[str, Any]]:
    """Compare each piece of evidence with the least that an accepted answer has."""
    needed = requirements(evidence, settings)
    return [
        {"title": title, "value": value, "least": least}
        for title, (_, value, least) in zip(EVIDENCE, needed, strict=True)
    ]


def measured_record(workspace: Workspace, index: int, pose: Similarity2, others: Sequence[int]) -> dict[str, Any]:
    """Measure a pose of a map on the sheet against each of the ``others``, and class the walls of all of them.

    ``walls`` holds a class for each wall point of a map, as base64 of a byte each.
    """
    found: dict[int, Measured] = {}
    for other in others:
        sheet = workspace.arrangement.placements[other].sheet_from_map
        found[other] = workspace.measurer.measure(other, index, sheet.inverse() @ pose)
    own = combine_classes([each.source_classes for each in found.values()], len(workspace.measurer.wall_points(index)))
    walls = {index: own, **{other: each.target_classes for other, each in found.items()}}
    return {
        "pairs": [
            {
                "other": other,
                "score": each.overlap.score,
                "overlap": _share(each.overlap.inlier_length, each.overlap.shorter_length),
                "agreement": each.overlap.inlier_ratio,
                "violation": each.overlap.violation_ratio,
            }
            for other, each in found.items()
        ],
        "walls": {str(each): base64.b64encode(classes.tobytes()).decode() for each, classes in walls.items()},
    }


def _share(part: float, whole: float) -> float:
    return min(1.0, part / whole) if whole > 0.0 else 0.0


def candidates_record(workspace: Workspace, index: int, other: int) -> dict[str, Any]:
    """Describe the answer of the pair and each candidate: its pose on the sheet and its score."""
    answer, found = workspace.candidates(index, other)
    sheet = workspace.arrangement.placements[other].sheet_from_map
    return {
        "map": index,
        "other": other,
        "answer": answer_record(workspace, answer),
        "candidates": [{**similarity_record(sheet @ pose), "score": score} for pose, score in found],
    }
