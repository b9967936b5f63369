"""Standard output that says its name where it cannot be written."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TextIO

from mapping.io.atomic import naming

NAME = Path("standard output")


class StandardOutput(io.TextIOWrapper):
    def write(self, text: str, /) -> int:
        with naming(NAME):
            return super().write(text)

    def flush(self) -> None:
        with naming(NAME):
            super().flush()


def named(stream: TextIO) -> TextIO:
    """The same stream, whose errors name it; as it is where it is no file, or none at all."""
    if not isinstance(stream, io.TextIOWrapper):
        return stream
    return StandardOutput(
        stream.buffer,
        stream.encoding,
        stream.errors,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )
