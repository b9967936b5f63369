"""Result files: one method on one data set, with its counts by stratum, beside its answers."""

from __future__ import annotations

from datetime import date
from pathlib import Path
from typing import Any

from mapping.io.safe_load import read_json, reading
from mapping.io.shape import Shape, require_shape

SCHEMA = "mapquilt-leaderboard/1"
ROOT = Path(__file__).parents[2] / "leaderboard"
ORIGINS = ("reproduced", "self-reported")
"""Reproduced: somebody else than the authors of the method ran it."""

SHARES = ("right", "true_accepts", "false_accepts", "accepted_right")
STRATUM: Shape = {"group": str, "stratum": str, "pairs": int, **dict.fromkeys(SHARES, list | None)}
TEXTS = ("schema", "method", "version", "reference", "ran_by", "origin", "date", "note")
RESULT: Shape = {
    **dict.fromkeys(TEXTS, str),
    "data": {"name": str, "digest": str, "made_by": str, "split": str | None, "limit": int | None, "pairs": int},
    "median_s": float | None,
    "strata": [STRATUM],
}


def read_result(path: Path) -> dict[str, Any]:
    """Read a result file. Raises ``ValueError`` naming the file and the field that is wrong."""
    record = read_json(path)
    require_shape(record, RESULT, str(path))
    with reading(path):
        date.fromisoformat(record["date"])
        if record["schema"] != SCHEMA:
            raise ValueError(f"schema is {record['schema']!r}, must be {SCHEMA!r}")
        if record["origin"] not in ORIGINS:
            raise ValueError(f"origin is {record['origin']!r}, must be one of {', '.join(ORIGINS)}")
        if record["data"]["name"] != path.resolve().parent.name:
            raise ValueError(f"the name of the data is {record['data']['name']!r}, must be that of the folder")
        if not path.with_suffix(".csv").is_file():
            raise ValueError(f"has no answers beside it: {path.with_suffix('.csv').name} is missing")
    return dict(record)


def read_results(root: Path = ROOT) -> dict[Path, dict[str, Any]]:
    """Read all result files below a folder, by their path.

    Raises ``ValueError`` naming the first file that is wrong, or has other data than the others of its folder.
    """
    found = {path: read_result(path) for path in sorted(root.glob("*/*.json"))}
    data: dict[Path, dict[str, Any]] = {}
    for path, record in found.items():
        if data.setdefault(path.parent, record["data"]) != record["data"]:
            raise ValueError(f"{path}: is about other data than the other results of {path.parent}")
    return found
