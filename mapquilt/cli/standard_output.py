"""Name standard output in errors of writing to it."""

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
    """Return the stream with errors that name it; unchanged if it is not a file."""
    if not isinstance(stream, io.TextIOWrapper):
        return stream
    return StandardOutput(
        stream.buffer,
        stream.encoding,
        stream.errors,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )
