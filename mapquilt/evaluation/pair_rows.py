"""Evaluated pairs as flat rows, the same in CSV and JSON, and rows of older versions."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO

from mapping.geometry.similarity2 import Similarity2
from mapping.io.shape import Shape, require_shape
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, GroundTruth, PairInfo
from mapquilt.evaluation.transform_error import TransformError
from mapquilt.json_file import OLD_EVIDENCE, similarity_record
from merge.records.evidence import Evidence
from merge.records.pair_answer import Alternative

TRANSFORM = ("x", "y", "yaw", "scale")
ERRORS = tuple(field.name for field in dataclasses.fields(TransformError))
EVIDENCE = tuple(field.name for field in dataclasses.fields(Evidence))
OPTIONAL_EVIDENCE = (
    *("acceptance_index", "wall_inlier_ratio", "free_space_violation", "deep_free_space_violation"),
    *("matches", "inliers", "local_violation", "conflict_ratio", "conflict_cells", "strain"),
    "alike_placements",
)
COLUMNS = (
    *("method", "set", "pair", "target", "source", "subset", "level", "world", "noise", "poses", "mission", "geometry"),
    *("true_overlap", "negative", "identifiable", "residual_m", "distorted"),
    *("outcome", "accepted", "right", "confidence", "reason", *ERRORS, "normalised_error"),
    *TRANSFORM,
    *(f"true_{part}" for part in TRANSFORM),
    *EVIDENCE,
    *(f"alternative_{part}" for part in TRANSFORM),
    *("alternative_score", "target_scale", "target_map", "source_map"),
)
TEXTS = (
    *("method", "set", "pair", "target", "source", "subset", "world", "poses", "mission", "geometry"),
    *("outcome", "reason", "target_map", "source_map"),
)
_FLAGS = ("negative", "identifiable", "distorted", "accepted", "right")
_SHAPE: dict[str, Shape] = {f"{name}?": str | None if name in TEXTS else float | None for name in COLUMNS}
_SHAPE |= {f"{name}?": bool | None for name in _FLAGS}
_SHAPE |= {"level?": list | None, "method": str, "pair": str}
OLD_NAMES = OLD_EVIDENCE | {
    "bent": "distorted",
    "runner_up_agreement": "alternative_score",
    **{f"runner_up_{part}": f"alternative_{part}" for part in TRANSFORM},
}
"""Columns of version 1 under their present names."""


def to_row(one: EvaluatedPair, folder: Path | None = None) -> dict[str, Any]:
    """Flatten a pair; None for values that do not apply. Times are left out, so that equal inputs give equal rows.

    Map files are named relative to ``folder``, or as the pair names them.
    """
    pair, truth = one.pair, one.truth
    row: dict[str, Any] = dict.fromkeys(COLUMNS)
    row |= {
        "method": one.method,
        "set": pair.suite,
        "pair": pair.name,
        "target": pair.target,
        "source": pair.source,
        "subset": pair.subset,
        "level": list(pair.level) or None,
        "world": pair.world,
        "noise": pair.noise,
        "poses": pair.poses,
        "mission": pair.mission,
        "geometry": pair.geometry,
        "true_overlap": truth.overlap,
        "negative": one.negative,
        "identifiable": one.identifiable,
        "residual_m": truth.residual_m,
        "distorted": one.distorted,
        "outcome": one.outcome,
        "accepted": one.accepted,
        "right": one.right,
        "confidence": one.confidence,
        "reason": one.reason,
        "normalised_error": one.normalised_error,
        "target_scale": truth.target_scale,
        "target_map": _relative(pair.target_file, folder),
        "source_map": _relative(pair.source_file, folder),
    }
    row |= {} if one.error is None else dataclasses.asdict(one.error)
    row |= {} if one.evidence is None else _without_nan(dataclasses.asdict(one.evidence))
    row |= _transform_cells("", one.answer) | _transform_cells("true_", truth.target_from_source)
    if one.alternative is not None:
        row |= _transform_cells("alternative_", one.alternative.target_from_source)
        row["alternative_score"] = one.alternative.score
    return row


def _relative(file: Path | None, folder: Path | None) -> str | None:
    if file is None or folder is None:
        return None if file is None else file.as_posix()
    return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()


def _without_nan(record: dict[str, Any]) -> dict[str, Any]:
    return {name: None if isinstance(value, float) and math.isnan(value) else value for name, value in record.items()}


def _transform_cells(prefix: str, transform: Similarity2 | None) -> dict[str, float]:
    return {} if transform is None else {f"{prefix}{part}": v for part, v in similarity_record(transform).items()}


def from_row(row: Mapping[str, Any], folder: Path = Path()) -> EvaluatedPair:
    """Read a row, of this version or the one before. Map files are relative to ``folder``.

    Evidence that the older version did not keep is NaN. Raises ``KeyError`` if a column is missing, ``ValueError`` if
    a value is of the wrong type.
    """
    row = {OLD_NAMES.get(name, name): value for name, value in row.items()}
    require_shape(row, _SHAPE, "row")
    get = row.get
    pair = PairInfo(
        name=row["pair"],
        target=get("target") or "target",
        source=get("source") or "source",
        suite=get("set") or "",
        subset=get("subset"),
        world=row["world"],
        noise=row["noise"],
        poses=get("poses"),
        mission=row["mission"],
        geometry=get("geometry"),
        level=tuple(get("level") or ()),
        target_file=None if row["target_map"] is None else folder / row["target_map"],
        source_file=None if row["source_map"] is None else folder / row["source_map"],
    )
    truth = GroundTruth(
        target_from_source=None if row["negative"] else _transform(row, "true_"),
        overlap=row["true_overlap"],
        identifiable=bool(row["identifiable"]),
        residual_m=get("residual_m"),
        target_scale=get("target_scale") or 1.0,
    )
    place = _transform(row, "alternative_")
    return EvaluatedPair(
        pair=pair,
        truth=truth,
        method=row["method"],
        accepted=row["accepted"],
        confidence=row["confidence"],
        reason=row["reason"],
        answer=_transform(row, ""),
        evidence=_evidence(row),
        alternative=None if place is None else Alternative(place, row["alternative_score"]),
        error=None if row["rotation_deg"] is None else TransformError(*(row[name] for name in ERRORS)),
        right=bool(row["right"]),
        distorted=row["distorted"],
        normalised_error=get("normalised_error"),
    )


def _transform(row: Mapping[str, Any], prefix: str) -> Similarity2 | None:
    x, y, yaw, scale = (row[f"{prefix}{part}"] for part in TRANSFORM)
    return None if x is None else Similarity2(x, y, yaw, scale)


def _evidence(row: Mapping[str, Any]) -> Evidence | None:
    if row["score"] is None:
        return None
    found = {name: row.get(name) for name in EVIDENCE}
    return Evidence(**{name: _or_nan(name, value) for name, value in found.items()})


def _or_nan(name: str, value: Any) -> Any:
    return math.nan if value is None and name not in OPTIONAL_EVIDENCE else value


def csv_text(rows: Iterable[Mapping[str, Any]], columns: Sequence[str] = COLUMNS) -> str:
    """Write rows as CSV; a cell without a value stays empty."""
    text = io.StringIO()
    write_csv(text, rows, columns)
    return text.getvalue()


def write_csv(file: TextIO, rows: Iterable[Mapping[str, Any]], columns: Sequence[str] = COLUMNS) -> None:
    """Write rows as ``csv_text`` does, one at a time."""
    writer = csv.DictWriter(file, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)


def read_csv_row(row: Mapping[str, str]) -> dict[str, Any]:
    """Parse the cells of a CSV row for ``from_row``."""
    return {name: _parsed(name, text) for name, text in row.items()}


def _parsed(name: str, text: str) -> Any:
    if text == "":
        return None
    if name in TEXTS:
        return text
    return text == "True" if text in ("True", "False") else json.loads(text)
