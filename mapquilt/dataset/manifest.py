"""manifest.jsonl: one line per plan, mission, sample and negative pair, in order, with no times, hosts or absolute
paths."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mapping.io.atomic import write_bytes_atomically
from mapping.io.safe_load import json_value
from mapquilt.json_file import present_record

MANIFEST_FILE = "manifest.jsonl"
SPEC_FILE = "spec.json"
MISSIONS_FOLDER = "missions"
SAMPLES_FOLDER = "samples"
SCHEMA = "mapquilt-manifest/2"

Record = dict[str, Any]


@dataclass(frozen=True)
class Manifest:
    """Hold the header of a data set and the records of its missions, samples, negative pairs of two worlds, and plans
    that it carries."""

    header: Record
    missions: tuple[Record, ...]
    samples: tuple[Record, ...]
    negatives: tuple[Record, ...]
    plans: tuple[Record, ...] = ()


def is_dataset(folder: Path) -> bool:
    """Check if a folder is a finished data set."""
    return (folder / MANIFEST_FILE).is_file()


def write_manifest(out: Path, manifest: Manifest) -> None:
    """Write the manifest, one record per line."""
    records = (manifest.header, *manifest.plans, *manifest.missions, *manifest.samples, *manifest.negatives)
    write_lines(out / MANIFEST_FILE, records)


def write_lines(path: Path, records: Iterable[Record]) -> None:
    """Write one record per line, atomically."""
    lines = (json.dumps(record, allow_nan=False, ensure_ascii=False) for record in records)
    write_bytes_atomically(path, "".join(f"{line}\n" for line in lines).encode())


def read_manifest(folder: Path) -> Manifest:
    """Read the manifest of a finished data set.

    Raises ``ValueError`` naming the file if it is missing, or the line that is wrong, and ``OSError`` otherwise.
    """
    path = folder / MANIFEST_FILE
    if not path.exists():
        raise ValueError(f"{path}: no such file; is {folder} a finished data set?")
    records = []
    for number, line in enumerate(path.read_bytes().splitlines(), start=1):
        record = json_value(line, f"{path}: line {number}")
        if not isinstance(record, dict):
            raise ValueError(f"{path}: line {number}: is not a record")
        records.append(record)
    if records:
        records = [present_record(record, records[0].get("schema")) for record in records]
    if not records or records[0].get("schema") != SCHEMA:
        raise ValueError(f"{path}: is not a manifest of schema {SCHEMA}")
    missions, samples, negatives, plans = (
        tuple(record for record in records if record.get("kind") == kind)
        for kind in ("mission", "sample", "other_worlds", "plan")
    )
    return Manifest(records[0], missions, samples, negatives, plans)
