"""The page for a report: read only, with all maps and answers in its HTML, so that it needs no server."""

from __future__ import annotations

import base64
import json
import re
import zlib
from importlib import resources
from itertools import combinations
from pathlib import Path
from typing import Any

from mapping.geometry.similarity2 import Similarity2
from mapquilt.align.describe import (
    answer_record,
    cell_bytes,
    measured_record,
    shown_grid,
    solved_record,
    start_record,
)
from mapquilt.align.open_task import open_task
from mapquilt.align.workspace import Workspace
from mapquilt.json_file import similarity_record
from mapquilt.merging.merge_file import load_answer
from mapquilt.merging.merge_inputs import read_merge
from mapquilt.runs import folder as run_folder

MODULES = ("geometry.js", "raster.js", "view.js", "thumbnail.js", "panel.js", "embedded.js", "main.js")
"""Modules of the page, each after those that it imports. ``embedded.js`` answers in place of the server."""

SHOWN = 4
"""Candidates of a pair that the page shows."""


def embedded_page(folder: Path) -> str:
    """Render the page on a merged run, or on a merge, as one HTML text.

    Raises ``ValueError`` or ``OSError`` naming a file that cannot be read.
    """
    record = json.dumps(page_record(folder), separators=(",", ":")).encode()
    data = base64.b64encode(zlib.compress(record, 9)).decode()
    html = _text("index.html")
    html = html.replace('<link rel="stylesheet" href="style.css">', f"<style>{_text('style.css')}</style>")
    html = html.replace('<script type="module" src="main.js"></script>\n', "")
    return html.replace(
        "</body>", f'<script type="text/plain" id="data">{data}</script>\n<script>{bundled()}</script>\n</body>'
    )


def page_record(folder: Path) -> dict[str, Any]:
    """Compute all that the page asks for: maps, verdicts of the merge, and measurements of the places to choose."""
    workspace = Workspace(open_task((folder,)))
    shown = [shown_grid(grid) for grid in workspace.maps.grids]
    merged, entries = load_answer(folder / run_folder.MERGE_FILE), read_merge(folder)["maps"]
    left_out = {entry["name"]: entry["reason"] for entry in entries if entry["reason"] is not None}
    count = len(workspace.maps)
    return {
        "start": {
            **start_record(workspace, [each.frame for each in shown]),
            "read_only": True,
            "solved": solved_record(workspace, merged.pairs, left_out),
        },
        "cells": [base64.b64encode(cell_bytes(each)).decode() for each in shown],
        "walls": [
            base64.b64encode(workspace.measurer.wall_points(index).astype("<f4").tobytes()).decode()
            for index in range(count)
        ],
        "pairs": [_pair_record(workspace, index, other) for other, index in combinations(range(count), 2)],
    }


def _pair_record(workspace: Workspace, index: int, other: int) -> dict[str, Any]:
    """Describe the answer of a pair, if the merge compared it, and measure where it lies and each candidate."""
    placed = workspace.arrangement.target_from_source(other, index)
    answer, found = workspace.candidates(index, other) if (other, index) in workspace.task.known else (None, ())
    found = found[:SHOWN]
    return {
        "map": index,
        "other": other,
        "answer": None if answer is None else answer_record(workspace, answer),
        "candidates": [{**similarity_record(pose), "score": score} for pose, score in found],
        "measured": [_measured(workspace, index, other, pose) for pose in (placed, *(pose for pose, _ in found))],
    }


def _measured(workspace: Workspace, index: int, other: int, other_from_map: Similarity2) -> dict[str, Any]:
    sheet = workspace.arrangement.placements[other].sheet_from_map
    return {
        "place": similarity_record(other_from_map),
        **measured_record(workspace, index, sheet @ other_from_map, [other]),
    }


def bundled() -> str:
    """Join the modules of the page in one script, since a page from a file cannot import others."""
    return "const modules = {};\n" + "\n".join(_scoped(name) for name in MODULES)


def _scoped(name: str) -> str:
    """Wrap a module in a function of its own that returns its exports."""
    source = _text(name)
    exported = re.findall(r"^export (?:const|class) ([\w$]+)", source, re.MULTILINE)
    source = re.sub(r"^export ", "", source, flags=re.MULTILINE)
    source = re.sub(r'^import (\{.*\}) from "\./(.+)";$', _imported, source, flags=re.MULTILINE)
    return f'modules["{name}"] = (() => {{\n{source}\nreturn {{ {", ".join(exported)} }};\n}})();'


def _imported(found: re.Match[str]) -> str:
    module = "embedded.js" if found[2] == "api.js" else found[2]
    return f'const {found[1]} = modules["{module}"];'


def _text(name: str) -> str:
    return (resources.files("mapquilt.align") / "page" / name).read_text(encoding="utf-8")
