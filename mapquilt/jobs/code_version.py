"""The version of the code: of the package, and a hash of its sources."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib import resources
from importlib.metadata import version
from pathlib import Path

PACKAGES = ("mapping", "worlds", "sim", "merge", "mapquilt")


@cache
def code_version() -> str:
    """Return the version of the package and 12 digits of the hash of its sources, such as ``0.2.0+3f2a...``."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        digest.update(code_digest(Path(str(resources.files(package)))).encode())
    return f"{version('mapquilt')}+{digest.hexdigest()[:12]}"


def code_digest(folder: Path) -> str:
    """Hash the names and contents of all Python files below a folder."""
    digest = hashlib.sha256()
    for file in sorted(folder.rglob("*.py")):
        digest.update(file.relative_to(folder).as_posix().encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()
