"""docs/files.md lists every field of the schemas."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mapping.io.robot_log_file import FIELDS

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/files.md").read_text(encoding="utf-8")
KINDS = sorted(path.name.split(".")[0] for path in (ROOT / "mapquilt/schemas").glob("*.schema.json"))


def fields(schema: Any) -> Iterator[str]:
    if isinstance(schema, dict):
        yield from schema.get("properties", {})
        for value in schema.values():
            yield from fields(value)
    elif isinstance(schema, list):
        for value in schema:
            yield from fields(value)


@pytest.mark.parametrize("kind", KINDS)
def test_each_field_of_a_record_has_its_line(kind: str) -> None:
    schema = json.loads((ROOT / f"mapquilt/schemas/{kind}.schema.json").read_text(encoding="utf-8"))
    _, section = re.split(rf"^### {kind}\.jsonl?$", PAGE, maxsplit=1, flags=re.MULTILINE)
    documented = set(re.findall(r"`(\w+)`", section.partition("\n### ")[0])) | {"x", "y", "yaw", "scale"}
    assert set(fields(schema)) <= documented, kind


def test_each_array_of_a_log_has_its_line() -> None:
    section = PAGE.partition("## Logs")[2].partition("\n## ")[0]
    assert set(FIELDS) <= set(re.findall(r"`(\w+)`", section))
