"""One door for untrusted files: regular ones only, of bounded size, as plain values, with errors of one line."""

from __future__ import annotations

import csv
import json
import lzma
import os
import re
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn
from xml.parsers import expat

import yaml

MAX_BYTES = 2**28
"""Maximum size of a JSON file."""

MAX_YAML_BYTES = 2**20
"""Maximum size of a YAML file, whose parser takes 6 seconds per megabyte; JSON holds the same 100 times faster."""

MAX_TEXT_BYTES = 2**27
"""Maximum size of a text file of numbers: a million poses."""

MAX_DEPTH = 50
"""Maximum depth of nested lists and fields; own files have less than ten levels."""

LARGEST_FLOAT = 1e15
"""Largest number: no length, angle or time is larger, and its square is still finite."""

LARGEST_INTEGER = 2**128
"""Largest integer, which a seed may have."""

READER_ERRORS: tuple[type[BaseException], ...] = (
    *(ArithmeticError, AssertionError, AttributeError, BufferError, EOFError, LookupError, OSError, RuntimeError),
    *(SyntaxError, TypeError, ValueError),
    *(csv.Error, lzma.LZMAError, struct.error, yaml.YAMLError, zipfile.BadZipFile, zipfile.LargeZipFile, zlib.error),
)
"""Base classes of all that the readers of the standard library, NumPy, Pillow and PyYAML raise for damaged files.

Their documentation names fewer: PyYAML raises ``KeyError`` for ``!!bool x``, zipfile ``RuntimeError`` for encryption.
"""

_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
"""Characters that steer a terminal, or reverse the order of others."""


@contextmanager
def reading(place: str | Path, *others: type[BaseException]) -> Iterator[None]:
    """Turn any error that a reader raises for a damaged file into a ``ValueError`` of one line that names the place.

    ``others`` are base classes of errors of another library. Errors of opening a file (``OSError`` with its name) pass.
    """
    try:
        yield
    except (*READER_ERRORS, *others) as error:
        if isinstance(error, OSError) and error.filename is not None:
            raise
        text = " ".join(str(error).split())[:300]
        if text.startswith(f"{place}: "):
            raise ValueError(text) from None
        if isinstance(error, yaml.MarkedYAMLError):
            text = _yaml_fault(error)
        elif isinstance(error, KeyError):
            text = f"has no {text}"
        elif isinstance(error, UnicodeDecodeError):
            text = f"byte {error.start + 1} is no text of UTF-8; save the file as UTF-8"
        elif not isinstance(error, ValueError):
            text = f"damaged or of another kind ({type(error).__name__}: {text})"
        raise ValueError(f"{place}: {text}") from None


def _yaml_fault(error: yaml.MarkedYAMLError) -> str:
    """Describe a fault of a YAML text by its place, and by its remedy where one is known."""
    start, mark = error.context_mark, error.problem_mark or error.context_mark
    problem = str(error.problem or error.context)
    if start is not None and problem == "could not find expected ':'":
        return f"line {start.line + 1} is no field with its value; a space must follow the colon"
    if mark is None:
        return problem
    if problem == "but found another document":
        return f"a second document begins at line {mark.line + 1}; keep one"
    return f"line {mark.line + 1}, column {mark.column + 1}: {problem}"


def read_limited(path: Path, max_bytes: int, may_be_empty: bool = False) -> bytes:
    """Read a regular file of at most ``max_bytes``; a pipe or a device is neither waited for nor read.

    Raises ``ValueError`` naming the file if it is empty, larger, or not a regular file; ``OSError`` if it cannot be
    read.
    """
    if path.is_dir():
        raise ValueError(f"{path}: not a file")
    with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as file:
        found = os.fstat(file.fileno())
        if not stat.S_ISREG(found.st_mode):
            raise ValueError(f"{path}: not a file")
        if found.st_size > max_bytes:
            raise ValueError(f"{path}: the file has {found.st_size} bytes, more than the {max_bytes} that are read")
        data = file.read(found.st_size + 1)
    if not data and not may_be_empty:
        raise ValueError(f"{path}: the file is empty")
    return data


def require_file(path: Path, max_bytes: int) -> None:
    """Check that a file that a library opens itself is regular and has at most ``max_bytes``.

    Raises as ``read_limited`` does, which reads the file instead.
    """
    found = path.stat()
    if not stat.S_ISREG(found.st_mode):
        raise ValueError(f"{path}: not a file")
    if not 0 < found.st_size <= max_bytes:
        raise ValueError(f"{path}: the file has {found.st_size} bytes, must have 1 to {max_bytes}")


def read_lines(path: Path) -> list[str]:
    """Read the lines of a text file of numbers; bytes that are not UTF-8 are replaced.

    Raises as ``read_limited`` does.
    """
    return read_limited(path, MAX_TEXT_BYTES).decode("utf-8", errors="replace").splitlines()


def read_json(path: Path) -> Any:
    """Read the value of a JSON file.

    Raises ``ValueError`` in one line that names the file if it is not JSON, nests too deeply, or has NaN, infinity, a
    number that is too large or a text with control characters; ``OSError`` if it cannot be read.
    """
    return json_value(read_limited(path, MAX_BYTES), str(path))


def json_value(data: bytes, place: str) -> Any:
    """Parse a JSON text. Raises ``ValueError`` as ``read_json`` does, naming ``place``."""
    with reading(f"{place}: not JSON"):
        value = json.loads(data.decode("utf-8"), parse_constant=_refuse_constant)
    return _checked(value, place)


def read_json_lines(path: Path) -> list[dict[str, Any]]:
    """Read a file with one JSON record on each line. Raises ``ValueError`` as ``read_json`` does, naming the line."""
    return json_lines(read_limited(path, MAX_BYTES), str(path))


def json_lines(data: bytes, place: str) -> list[dict[str, Any]]:
    """Parse one JSON record on each line. Raises ``ValueError`` as ``read_json`` does, naming ``place`` and line."""
    records = []
    for number, line in enumerate(data.split(b"\n")[: data.count(b"\n") + (not data.endswith(b"\n"))], start=1):
        record = json_value(line, f"{place}: line {number}")
        if not isinstance(record, dict):
            raise ValueError(f"{place}: line {number}: is not a record")
        records.append(record)
    return records


def read_yaml(path: Path) -> Any:
    """Read the value of a YAML file without aliases, a few lines of which can expand to more than the memory.

    Raises as ``read_json`` does, but allows NaN, which the yaw of a map may be.
    """
    return yaml_value(read_limited(path, MAX_YAML_BYTES), str(path))


def yaml_value(data: bytes, place: str) -> Any:
    """Parse a YAML text. Raises ``ValueError`` as ``read_yaml`` does, naming ``place``."""
    with reading(f"{place}: not YAML"):
        if b"*" in data and any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(data, yaml.SafeLoader)):
            raise ValueError("it has aliases, which are not allowed")
        value = yaml.safe_load(data)
    return _checked(value, place)


def refuse_entities(data: bytes) -> None:
    """Raise ``ValueError`` if an XML text, in whatever encoding, is malformed or defines entities.

    A few lines of entities expand to more than the memory, or read other files.
    """
    parser = expat.ParserCreate()
    parser.EntityDeclHandler = _refuse_entity
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise ValueError(f"is no XML: {error}") from None


def _refuse_entity(*declared: object) -> NoReturn:
    raise ValueError("defines entities, which are not read")


def printable(text: str) -> str:
    """Return the text with control characters, which steer a terminal, as escapes such as ``\\x1b``."""
    return _CONTROL.sub(lambda found: found.group().encode("unicode_escape").decode(), text)


def _refuse_constant(text: str) -> NoReturn:
    raise ValueError(f"it holds {text}, which is not finite")


def _checked(value: Any, place: str) -> Any:
    level = [value]
    for _ in range(MAX_DEPTH):
        for each in level:
            _check_leaf(each, place)
        level = [child for each in level for child in _children(each)]
        if not level:
            return value
    raise ValueError(f"{place}: nests more than {MAX_DEPTH} levels deep")


def _children(value: Any) -> list[Any]:
    if isinstance(value, dict):
        return [*value, *value.values()]
    return value if isinstance(value, list) else []


def _check_leaf(value: Any, place: str) -> None:
    if isinstance(value, float) and abs(value) > LARGEST_FLOAT:
        raise ValueError(f"{place}: holds the number {value}, must lie within {LARGEST_FLOAT:g} of zero")
    if isinstance(value, int) and abs(value) > LARGEST_INTEGER:
        raise ValueError(f"{place}: holds an integer of more than 128 bits")
    if isinstance(value, str) and _CONTROL.search(value):
        raise ValueError(f"{place}: holds the text {printable(value)[:80]!r}, must have no control character")
