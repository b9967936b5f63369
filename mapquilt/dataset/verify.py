"""Verification of a data set against the hashes of its manifest."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

from mapquilt.dataset.manifest import MISSIONS_FOLDER, SAMPLES_FOLDER, read_manifest
from mapquilt.merging.merge_folder import is_answer


def verify_dataset(folder: Path, on_progress: Callable[[int, int], None] = lambda done, total: None) -> list[str]:
    """List one line for each file that is missing, changed or in no record.

    Files that ``mapquilt merge`` and ``score`` add to a sample are ignored. Raises ``ValueError`` if the folder is not
    a finished data set.
    """
    manifest = read_manifest(folder)
    expected = {
        f"{place}/{record[kind]}/{path}": digest
        for place, kind, records in (
            (MISSIONS_FOLDER, "mission", manifest.missions),
            (SAMPLES_FOLDER, "sample", manifest.samples),
        )
        for record in records
        for path, digest in record["files"].items()
    }
    problems = []
    for done, (path, digest) in enumerate(expected.items(), start=1):
        problem = _problem(folder / path, digest)
        if problem is not None:
            problems.append(f"{path}: {problem}")
        on_progress(done, len(expected))
    return problems + [f"{path}: is in no record" for path in _found(folder) if path not in expected]


def _problem(path: Path, digest: str) -> str | None:
    if not path.is_file():
        return "is missing"
    return None if hashlib.sha256(path.read_bytes()).hexdigest() == digest else "has changed"


def _found(folder: Path) -> list[str]:
    places = (folder / MISSIONS_FOLDER, folder / SAMPLES_FOLDER)
    paths = (path for place in places for path in place.rglob("*") if path.is_file())
    return sorted(path.relative_to(folder).as_posix() for path in paths if not _is_answer(folder, path))


def _is_answer(folder: Path, path: Path) -> bool:
    return is_answer(path.name) and path.parent.parent == folder / SAMPLES_FOLDER
