"""Golden files: a JSON file for each family of worlds, an excerpt of an evaluated pair in each line."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from mapping.io.safe_load import read_json
from mapping.io.transaction import write_files_atomically
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, Outcome

SCHEMA, OLD_SCHEMA = "mapquilt-golden/2", "mapquilt-golden/1"
OLD_OUTCOMES = {
    "right": "true accept",
    "wrong": "false accept",
    "missed": "false reject",
    "rightly refused": "true reject",
}
"""Outcomes of version 1 under their present names."""

DECIMALS = 4


@dataclass(frozen=True)
class GoldenPair:
    """Rounded excerpt of an evaluated pair; ``sample`` is the hash of the maps and the truth."""

    name: str
    sample: str
    overlap: float | None
    outcome: Outcome | None
    confidence: float | None
    rotation_deg: float | None
    scale_percent: float | None
    displacement_cells: float | None
    reason: str | None

    @staticmethod
    def of(one: EvaluatedPair, sample: str) -> GoldenPair:
        return GoldenPair(
            name=one.pair.name,
            sample=sample,
            overlap=_rounded(one.truth.overlap),
            outcome=one.outcome,
            confidence=_rounded(one.confidence),
            rotation_deg=_rounded(one.error.rotation_deg if one.error else None),
            scale_percent=_rounded(one.error.scale_percent if one.error else None),
            displacement_cells=_rounded(one.error.displacement_cells if one.error else None),
            reason=one.reason,
        )


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, DECIMALS)


GoldenFiles = dict[str, dict[str, GoldenPair]]
"""By family and name of the pair."""


def read_golden(folder: Path) -> GoldenFiles:
    """Read all golden files of a folder. Raises ``ValueError`` or ``OSError`` naming a file that is wrong."""
    found: GoldenFiles = {}
    for path in sorted(folder.glob("*.json")):
        record = read_json(path)
        try:
            if record["schema"] not in (SCHEMA, OLD_SCHEMA):
                raise ValueError(f"schema is {record['schema']!r}, must be {SCHEMA!r}")
            pairs = [GoldenPair(**entry | {"outcome": _outcome(entry["outcome"])}) for entry in record["pairs"]]
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"{path}: is no golden file: {error}") from None
        found[path.stem] = {pair.name: pair for pair in pairs}
    return found


def _outcome(name: str) -> str:
    return OLD_OUTCOMES.get(name, name)


def write_golden(folder: Path, golden: Mapping[str, Mapping[str, GoldenPair]]) -> None:
    """Write a file for each family, all or none, and delete those of families that are gone."""
    folder.mkdir(parents=True, exist_ok=True)
    write_files_atomically({folder / f"{family}.json": _bytes(found) for family, found in golden.items()})
    for path in folder.glob("*.json"):
        if path.stem not in golden:
            path.unlink()


def _bytes(pairs: Mapping[str, GoldenPair]) -> bytes:
    """Write a line for each pair, so that a diff shows whole pairs."""
    lines = ",\n".join(f"  {json.dumps(dataclasses.asdict(pair))}" for pair in pairs.values())
    return f'{{"schema": "{SCHEMA}", "pairs": [\n{lines}\n]}}\n'.encode()
