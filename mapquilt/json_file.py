"""Read and write JSON files with versioned schemas. Equal records give equal bytes."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from mapping.geometry.similarity2 import Similarity2
from mapping.io.atomic import write_bytes_atomically
from mapping.io.safe_load import read_json
from mapping.io.transaction import finish_transaction

OLD_EVIDENCE = {
    "agreement": "score",
    "rival_agreement": "second_best_score",
    "walls_on_walls": "wall_inlier_ratio",
    "walls_in_free": "free_space_violation",
    "walls_deep_in_free": "deep_free_space_violation",
    "matched_walls_cells": "inlier_length_cells",
    "spread": "normal_isotropy",
    "exactness": "precision_probability",
}
"""Names of evidence in version 1 of the records, and the present ones."""

_TRUTH = {"true_agreement": "true_score", "rival_agreement": "second_best_score"}
_CLUSTERS = {"over_missions": "clustered"}
_SETTINGS = {"disguise": "frame_perturbation"}
OLD_SCHEMAS = {
    "mapquilt-merge/1": ("mapquilt-merge/2", OLD_EVIDENCE),
    "mapquilt-run/1": ("mapquilt-run/2", _SETTINGS),
    "mapquilt-truth/1": ("mapquilt-truth/2", _TRUTH),
    "mapquilt-benchmark/2": ("mapquilt-benchmark/3", _CLUSTERS),
    "mapquilt-study/2": ("mapquilt-study/3", _CLUSTERS),
    "mapquilt-manifest/1": ("mapquilt-manifest/2", _SETTINGS | _TRUTH),
}
"""Older schemas that are still read: the present schema, and the present names of renamed fields."""


@cache
def _validator(kind: str) -> Any:
    import jsonschema  # here: it takes long to load, and printing a merge needs no record

    text = (resources.files("mapquilt") / "schemas" / f"{kind}.schema.json").read_text(encoding="utf-8")
    return jsonschema.Draft202012Validator(json.loads(text))


def write_record(path: Path, kind: str, record: dict[str, Any]) -> None:
    """Check ``record`` against its schema and write it atomically."""
    write_bytes_atomically(path, record_bytes(path, kind, record))


def record_bytes(path: Path, kind: str, record: dict[str, Any]) -> bytes:
    """Check ``record`` against its schema and return the content of its file."""
    check_record(path, kind, record)
    return to_text(record).encode()


def to_text(record: dict[str, Any]) -> str:
    """Format a record as JSON, with numbers at full precision."""
    return json.dumps(record, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def read_record(path: Path, kind: str) -> dict[str, Any]:
    """Read a JSON file, of the present schema of its kind or an older one, with the present names of all fields.

    A transaction that a killed writer left in its folder is finished first.

    Raises ``ValueError`` with the file and the fault, ``OSError`` if it cannot be read.
    """
    finish_transaction(path.parent)
    record = read_json(path)
    if isinstance(record, dict):
        record = present_record(record, record.get("schema"))
    check_record(path, kind, record)
    return dict(record)


def present_record(record: dict[str, Any], schema: Any) -> dict[str, Any]:
    """Return a record of an older ``schema`` with the present schema and names; any other unchanged."""
    if str(schema) not in OLD_SCHEMAS:
        return record
    present, names = OLD_SCHEMAS[schema]
    return {**_renamed(record, names), **({"schema": present} if "schema" in record else {})}


def _renamed(value: Any, names: dict[str, str]) -> Any:
    if isinstance(value, dict):
        return {names.get(name, name): _renamed(part, names) for name, part in value.items()}
    return [_renamed(part, names) for part in value] if isinstance(value, list) else value


def check_record(path: Path, kind: str, record: Any) -> None:
    """Raise ``ValueError`` with the file, the field and the fault if a record does not fit its schema."""
    from jsonschema.exceptions import best_match

    error = best_match(_validator(kind).iter_errors(record))
    if error is not None:
        where = error.json_path.removeprefix("$").removeprefix(".") or "the record"
        raise ValueError(f"{path}: {where}: {error.message.splitlines()[0][:200]}")


def similarity_record(transform: Similarity2) -> dict[str, float]:
    return {"x": transform.x, "y": transform.y, "yaw": transform.yaw, "scale": transform.scale}


def similarity_from_record(record: dict[str, float]) -> Similarity2:
    return Similarity2(record["x"], record["y"], record["yaw"], record["scale"])
