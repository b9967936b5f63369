"""JSON and YAML read as plain values: the one place for both, which names the file in whatever it refuses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NoReturn

import yaml

from mapping.io.picture import read_limited

MAX_BYTES = 2**28
"""The largest file that is read."""

MAX_YAML_BYTES = 2**24
"""The largest YAML file that is read: its parser takes seconds a megabyte."""

MAX_DEPTH = 50
"""Lists in lists, fields in fields: ours nest less than ten deep."""

LARGEST_FLOAT = 1e15
"""Beyond it nothing is a length, an angle or a time, and squares of it soon have no end."""

LARGEST_INTEGER = 2**128
"""Seeds may be that large."""


def read_json(path: Path) -> Any:
    """The value of a JSON file.

    Raises ``ValueError`` in one line that names the file where it is none, nests too deeply, or holds NaN, infinity
    or a number past any measure; ``OSError`` where it cannot be read.
    """
    return json_value(read_limited(path, MAX_BYTES), str(path))


def json_value(data: bytes, place: str) -> Any:
    """The value of a JSON text, refused as ``read_json`` refuses, naming ``place``."""
    try:
        value = json.loads(data.decode("utf-8"), parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{place}: not JSON: {_short(error)}") from None
    return _checked(value, place)


def read_yaml(path: Path) -> Any:
    """The value of a YAML file; aliases are refused, as a few lines of them can stand for more than fits in memory.

    Raises as ``read_json`` does, but leaves NaN, which the yaw of a map may be, to the caller.
    """
    return yaml_value(read_limited(path, MAX_YAML_BYTES), str(path))


def yaml_value(data: bytes, place: str) -> Any:
    """The value of a YAML text, refused as ``read_yaml`` refuses, naming ``place``."""
    try:
        if b"*" in data and any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(data, yaml.SafeLoader)):
            raise ValueError("aliases are not read")
        value = yaml.safe_load(data)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ValueError(f"{place}: not YAML: {_short(error)}") from None
    return _checked(value, place)


def _refuse_constant(text: str) -> NoReturn:
    raise ValueError(f"it holds {text}, which is not finite")


def _short(error: Exception) -> str:
    return " ".join(str(error).split())[:200]


def _checked(value: Any, place: str) -> Any:
    level = [value]
    for _ in range(MAX_DEPTH):
        for each in level:
            _check_number(each, place)
        level = [child for each in level for child in _children(each)]
        if not level:
            return value
    raise ValueError(f"{place}: nests more than {MAX_DEPTH} levels deep")


def _children(value: Any) -> list[Any]:
    if isinstance(value, dict):
        return list(value.values())
    return value if isinstance(value, list) else []


def _check_number(value: Any, place: str) -> None:
    if isinstance(value, float) and abs(value) > LARGEST_FLOAT:
        raise ValueError(f"{place}: holds the number {value}, must lie within {LARGEST_FLOAT:g} of zero")
    if isinstance(value, int) and abs(value) > LARGEST_INTEGER:
        raise ValueError(f"{place}: holds an integer of more than 128 bits")
