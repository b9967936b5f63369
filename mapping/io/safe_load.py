"""JSON and YAML from untrusted files, as plain values."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NoReturn

import yaml

from mapping.io.picture import read_limited

MAX_BYTES = 2**28
"""Maximum size of a JSON file."""

MAX_YAML_BYTES = 2**24
"""Maximum size of a YAML file, whose parser takes seconds per megabyte."""

MAX_DEPTH = 50
"""Maximum depth of nested lists and fields; own files have less than ten levels."""

LARGEST_FLOAT = 1e15
"""Largest number: no length, angle or time is larger, and its square is still finite."""

LARGEST_INTEGER = 2**128
"""Largest integer, which a seed may have."""


def read_json(path: Path) -> Any:
    """Read the value of a JSON file.

    Raises ``ValueError`` in one line that names the file if it is not JSON, nests too deeply, or has NaN, infinity or
    a number that is too large; ``OSError`` if it cannot be read.
    """
    return json_value(read_limited(path, MAX_BYTES), str(path))


def json_value(data: bytes, place: str) -> Any:
    """Parse a JSON text. Raises ``ValueError`` as ``read_json`` does, naming ``place``."""
    try:
        value = json.loads(data.decode("utf-8"), parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{place}: not JSON: {_short(error)}") from None
    return _checked(value, place)


def read_yaml(path: Path) -> Any:
    """Read the value of a YAML file without aliases, a few lines of which can expand to more than the memory.

    Raises as ``read_json`` does, but allows NaN, which the yaw of a map may be.
    """
    return yaml_value(read_limited(path, MAX_YAML_BYTES), str(path))


def yaml_value(data: bytes, place: str) -> Any:
    """Parse a YAML text. Raises ``ValueError`` as ``read_yaml`` does, naming ``place``."""
    try:
        if b"*" in data and any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(data, yaml.SafeLoader)):
            raise ValueError("it has aliases, which are not allowed")
        value = yaml.safe_load(data)
    except (yaml.YAMLError, ValueError, LookupError, AttributeError, RecursionError) as error:
        # PyYAML lets the errors of its constructors through, such as KeyError for `!!bool x`.
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
