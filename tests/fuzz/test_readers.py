"""Fuzz the readers: our own files, damaged, are read or refused by one line that names the file.

``FUZZ_CASES`` sets the number of cases of each reader; ``make fuzz`` draws new ones each time, and bounds time and
memory of each case.
"""

from __future__ import annotations

import json
import os
import tempfile
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.fuzz.bounds import TooLongError, bounded
from tests.fuzz.corpus import HOSTILE_FIELDS, READERS, content

LONG = "FUZZ_CASES" in os.environ
FUZZ = settings(
    max_examples=int(os.environ.get("FUZZ_CASES", "40")),
    derandomize=not LONG,
    suppress_health_check=list(HealthCheck),
)
HOSTILE: tuple[Any, ...] = (
    *(None, True, -1, 0, 0.5, 1e15, -1e15, 2**63, 2**127, "", "../x", "/etc/passwd", "\x1b[31m", "x" * 10_000),
    *([], {}, [[]], {"": None}, [0] * 1000),
)

EDIT = st.tuples(st.integers(0, 10**6), st.sampled_from(("set", "cut", "drop", "copy")), st.integers(0, 255))


def damaged(data: bytes, edits: list[tuple[int, str, int]]) -> bytes:
    """Change bytes, truncate, remove a piece, or copy one to another place."""
    for at, kind, value in edits:
        at = at % max(len(data), 1)
        if kind == "set":
            data = data[:at] + bytes([value]) + data[at + 1 :]
        elif kind == "cut":
            data = data[:at] if value < 32 else data
        elif kind == "drop":
            data = data[:at] + data[at + value :]
        else:
            data = data[:at] + data[at // 2 : at // 2 + value] + data[at:]
    return data


def refusal(reader: str, data: bytes) -> str | None:
    """Read the bytes; return the line by which they are refused, with the folder cut off, None if they are read."""
    name, _, read = READERS[reader]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        for other, bytes_ in content(reader)[1].items():
            (Path(folder) / other).write_bytes(bytes_)
        path.write_bytes(data)
        try:
            with bounded() if LONG else nullcontext():
                read(path)
        except (ValueError, OSError) as error:
            return str(error).replace(f"{folder}/", "FOLDER/")
    return None


def is_one_line(line: str | None) -> bool:
    """Return whether there is no refusal, or one line that names a file of the folder."""
    return line is None or ("FOLDER/" in line and "\n" not in line)


@pytest.mark.parametrize("reader", READERS)
def test_the_undamaged_file_is_read(reader: str) -> None:
    assert refusal(reader, content(reader)[0]) is None


@pytest.mark.parametrize("reader", READERS)
@FUZZ
@given(edits=st.lists(EDIT, min_size=1, max_size=5))
def test_damaged_bytes_are_read_or_refused(reader: str, edits: list[tuple[int, str, int]]) -> None:
    assert is_one_line(refusal(reader, damaged(content(reader)[0], edits)))


def leaves(value: Any) -> list[tuple[Any, Any]]:
    """List every container of a JSON value with each of its keys."""
    if isinstance(value, list | dict):
        keys = list(value) if isinstance(value, dict) else list(range(min(len(value), 5)))
        return [(value, key) for key in keys] + [found for key in keys for found in leaves(value[key])]
    return []


@pytest.mark.parametrize("reader", HOSTILE_FIELDS)
@FUZZ
@given(at=st.integers(0, 10**6), value=st.sampled_from(HOSTILE))
def test_hostile_values_are_read_or_refused(reader: str, at: int, value: Any) -> None:
    record = [json.loads(line) for line in content(reader)[0].splitlines()]
    places = leaves(record)[len(record) :]
    holder, key = places[at % len(places)]
    holder[key] = value
    assert is_one_line(refusal(reader, b"\n".join(json.dumps(line).encode() for line in record)))


def test_a_case_is_bounded() -> None:
    with pytest.raises(MemoryError), bounded():
        bytearray(2**31)
    with pytest.raises(TooLongError), bounded(seconds=0.1):
        while True:
            pass
