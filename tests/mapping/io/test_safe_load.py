"""JSON and YAML: exact round trips, and refusals in one line with the name of the file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from mapping.io.safe_load import MAX_DEPTH, read_json, read_yaml

GOOD = {"seed": 2**100, "x": -1.5e9, "names": ["a", None, True], "é": {}}


def refusal(path: Path, data: bytes) -> str:
    path.write_bytes(data)
    with pytest.raises(ValueError, match=r"\S") as caught:
        (read_json if path.suffix == ".json" else read_yaml)(path)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 400 + len(str(path))
    assert message.startswith(f"{path}: ")
    return message.removeprefix(f"{path}: ")


def test_plain_values_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "good.json"
    path.write_text(json.dumps(GOOD))
    assert read_json(path) == read_yaml(path) == GOOD
    deep = b"[" * (MAX_DEPTH - 1) + b"1" + b"]" * (MAX_DEPTH - 1)
    path.write_bytes(deep)
    assert json.dumps(read_json(path)).encode() == deep


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bad.json", "bad.yaml"])
@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "the file is empty"),
        (b"[1, 2", "not "),
        (b'{"x": "\xff"}', "not "),
        (b'{"x": 1.0e+308}', "holds the number 1e+308, must lie within 1e+15 of zero"),
        (b'{"x": [0.0, {"y": -1.0e+99}]}', "holds the number -1e+99"),
        (b'{"x": ' + b"9" * 5000 + b"}", "not "),
        (b'{"x": ' + b"9" * 400 + b"}", "holds an integer of more than 128 bits"),
        (b"[" * 60 + b"]" * 60, "nests more than 50 levels deep"),
        (b'{"a":' * 60 + b"1" + b"}" * 60, "nests more than 50 levels deep"),
        (b"[" * 100_000, "not "),
    ],
)
def test_unusable_files_are_refused_by_name(tmp_path: Path, name: str, text: bytes, message: str) -> None:
    assert refusal(tmp_path / name, text).startswith(message)


@pytest.mark.parametrize("constant", [b"NaN", b"Infinity", b"-Infinity", b"1e999"])
def test_json_with_numbers_that_are_not_finite_is_refused(tmp_path: Path, constant: bytes) -> None:
    assert any(word in refusal(tmp_path / "bad.json", b"[%s]" % constant) for word in ("NaN", "Infinity", "inf"))


@pytest.mark.parametrize(
    "text",
    [
        b"x: .inf",
        b"x: 2001-99-99",
        b"a: &a [1]\nb: *a",
        b"{? {} : 1}",
        b"x: !!python/name:os.system",
        b"!!bool x",
        b"!!timestamp x",
    ],
)
def test_yaml_tags_and_aliases_are_refused(tmp_path: Path, text: bytes) -> None:
    assert refusal(tmp_path / "bad.yaml", text)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    for read in (read_json, read_yaml):
        with pytest.raises(FileNotFoundError, match="none"):
            read(tmp_path / "none.json")
