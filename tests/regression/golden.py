"""The golden files: a JSON file for each family of worlds."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path

from mapping.io.atomic import write_files_aside
from mapping.io.safe_load import read_json
from tests.regression.verdict import Verdict

SCHEMA = "mapquilt-golden/1"

Verdicts = dict[str, dict[str, Verdict]]
"""By family and name of the pair."""


def read_golden(folder: Path) -> Verdicts:
    """All golden files of a folder. Raises ``ValueError`` naming the file that is none, ``OSError`` where one cannot
    be read."""
    found: Verdicts = {}
    for path in sorted(folder.glob("*.json")):
        record = read_json(path)
        try:
            if record["schema"] != SCHEMA:
                raise ValueError(f"schema is {record['schema']!r}, must be {SCHEMA!r}")
            verdicts = [Verdict(**entry) for entry in record["pairs"]]
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"{path}: is no golden file: {error}") from None
        found[path.stem] = {verdict.name: verdict for verdict in verdicts}
    return found


def write_golden(folder: Path, verdicts: Mapping[str, Mapping[str, Verdict]]) -> None:
    """Write a file for each family, all or none, and take away those of families that are gone."""
    folder.mkdir(parents=True, exist_ok=True)
    write_files_aside({folder / f"{family}.json": _bytes(found) for family, found in verdicts.items()})
    for path in folder.glob("*.json"):
        if path.stem not in verdicts:
            path.unlink()


def _bytes(verdicts: Mapping[str, Verdict]) -> bytes:
    """A line for each pair, so that a difference shows whole."""
    lines = ",\n".join(f"  {json.dumps(dataclasses.asdict(verdict))}" for verdict in verdicts.values())
    return f'{{"schema": "{SCHEMA}", "pairs": [\n{lines}\n]}}\n'.encode()
