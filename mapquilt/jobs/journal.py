"""What of a data set is done already, kept on disk while it is being made."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mapping.io.atomic import naming
from mapping.io.safe_load import json_value

LOCK_FILE = ".lock"
JOURNAL_FILE = ".journal.jsonl"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder for this process alone. The lock dies with the process.

    Raises ``ValueError`` where another process holds it.
    """
    with (folder / LOCK_FILE).open("a") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError(f"{folder}: another mapquilt is writing into it") from None
        yield


class Journal:
    """One line of JSON for each finished group, forced to the disk before the next begins."""

    def __init__(self, folder: Path, name: str = JOURNAL_FILE) -> None:
        self.path = folder / name

    def entries(self) -> list[dict[str, Any]]:
        """The finished groups; a last line that a kill cut off is dropped from the file."""
        if not self.path.exists():
            return []
        data = self.path.read_bytes()
        whole = data[: data.rfind(b"\n") + 1]
        if len(whole) < len(data):
            with self.path.open("r+b") as file:
                file.truncate(len(whole))
        return [json_value(line, str(self.path)) for line in whole.splitlines()]

    def add(self, entry: dict[str, Any]) -> None:
        with naming(self.path), self.path.open("ab") as file:
            file.write(json.dumps(entry, allow_nan=False).encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())

    def remove(self) -> None:
        self.path.unlink(missing_ok=True)
