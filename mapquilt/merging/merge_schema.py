"""Versions of merge.json: records of an older schema are read with the field names of the current one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mapping.io.safe_load import read_json
from mapquilt.json_file import check_record

SCHEMA = "mapquilt-merge/2"
OLD_SCHEMA = "mapquilt-merge/1"
RENAMED = {
    "agreement": "score",
    "rival_agreement": "second_best_score",
    "walls_on_walls": "wall_inlier_ratio",
    "walls_in_free": "free_space_violation",
    "walls_deep_in_free": "deep_free_space_violation",
    "matched_walls_cells": "inlier_length_cells",
    "spread": "normal_isotropy",
    "exactness": "precision_probability",
}
"""Fields of the older schema, and their names in this one."""


def read_merge_record(path: Path) -> dict[str, Any]:
    """Read merge.json of this schema or the one before, with the field names of this one.

    Raises ``ValueError`` that names the file and what is wrong with it, ``OSError`` where it cannot be read.
    """
    record = read_json(path)
    if isinstance(record, dict) and record.get("schema") == OLD_SCHEMA:
        record = _renamed(record) | {"schema": SCHEMA}
    check_record(path, "merge", record)
    return dict(record)


def _renamed(value: Any) -> Any:
    if isinstance(value, dict):
        return {RENAMED.get(name, name): _renamed(part) for name, part in value.items()}
    return [_renamed(part) for part in value] if isinstance(value, list) else value
