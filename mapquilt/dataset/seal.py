"""SHA256SUMS: digests of the manifest and the other files at the top of a data set, as ``sha256sum --check`` reads."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path

from mapping.io.safe_load import read_limited

SEAL_FILE = "SHA256SUMS"
MAX_SEAL_BYTES = 2**16
"""Maximum size; a seal has about five lines."""

_LINE = re.compile(r"([0-9a-f]{64})  ([\w-]+(?:\.[\w-]+)*)")


def seal_bytes(files: Mapping[str, bytes]) -> bytes:
    """Build a seal of files at the top of a data set, given their content by name."""
    return "".join(f"{hashlib.sha256(files[name]).hexdigest()}  {name}\n" for name in sorted(files)).encode()


def read_seal(folder: Path) -> dict[str, str]:
    """Read the digest of each sealed file; none if the data set is older than seals.

    Raises ``ValueError`` naming the line that is wrong, and ``OSError`` if the file cannot be read.
    """
    path = folder / SEAL_FILE
    if not path.exists():
        return {}
    digests: dict[str, str] = {}
    lines = read_limited(path, MAX_SEAL_BYTES).decode("utf-8", errors="replace").splitlines()
    for number, line in enumerate(lines, start=1):
        found = _LINE.fullmatch(line)
        if found is None or found[2] in digests:
            raise ValueError(f"{path}: line {number}: must be a SHA-256, two spaces and a new name")
        digests[found[2]] = found[1]
    return digests


def file_problem(path: Path, digest: str) -> str | None:
    """Compare a file with its SHA-256: None if they agree."""
    if not path.is_file():
        return "is missing"
    with path.open("rb") as file:
        return None if hashlib.file_digest(file, "sha256").hexdigest() == digest else "has changed"
