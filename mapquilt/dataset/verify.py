"""Verification of a data set: its files against the hashes of its manifest, and its worlds by their content."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

from mapquilt.dataset.carried_plans import PLANS_FOLDER
from mapquilt.dataset.manifest import MISSIONS_FOLDER, SAMPLES_FOLDER, Manifest, Record, read_manifest
from mapquilt.json_file import read_record
from mapquilt.merging.merge_folder import is_answer
from sim.mission.file import WORLD_FILE
from worlds.world_file import world_from_json


def verify_dataset(folder: Path, on_progress: Callable[[int, int], None] = lambda done, total: None) -> list[str]:
    """List one line for each file that is missing, changed or in no record, for each world in two splits, and for
    each negative pair whose maps show one world.

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
    } | {record["file"]: record["sha256"] for record in manifest.plans}
    problems = []
    for done, (path, digest) in enumerate(expected.items(), start=1):
        problem = _problem(folder / path, digest)
        if problem is not None:
            problems.append(f"{path}: {problem}")
        on_progress(done, len(expected))
    problems += [f"{path}: is in no record" for path in _found(folder) if path not in expected]
    return problems if problems else _shared_worlds(folder, manifest)


def _shared_worlds(folder: Path, manifest: Manifest) -> list[str]:
    worlds = {
        record["mission"]: world_from_json(
            read_record(folder / MISSIONS_FOLDER / record["mission"] / WORLD_FILE, "world")
        )
        for record in manifest.missions
    }
    content = {mission: world.fingerprint for mission, world in worlds.items()}
    first: dict[str, Record] = {}
    problems = []
    for record in manifest.missions:
        other = first.setdefault(content[record["mission"]], record)
        if other["split"] != record["split"]:
            problems.append(
                f"{MISSIONS_FOLDER}/{record['mission']}: is in the world of {MISSIONS_FOLDER}/{other['mission']}, "
                f"but in the split {record['split']}, not {other['split']}"
            )
    mission_of = {sample["sample"]: sample["mission"] for sample in manifest.samples}
    for pair in manifest.negatives:
        ends = [pair["target"], pair["source"]]
        if len({content[mission_of[end["sample"]]] for end in ends}) == 1:
            names = " and ".join(f"{SAMPLES_FOLDER}/{end['sample']}/{end['map']}" for end in ends)
            problems.append(f"{names}: are of one world, although the manifest calls them a negative pair")
    return problems


def _problem(path: Path, digest: str) -> str | None:
    if not path.is_file():
        return "is missing"
    return None if hashlib.sha256(path.read_bytes()).hexdigest() == digest else "has changed"


def _found(folder: Path) -> list[str]:
    places = (folder / MISSIONS_FOLDER, folder / SAMPLES_FOLDER, folder / PLANS_FOLDER)
    paths = (path for place in places for path in place.rglob("*") if path.is_file())
    return sorted(path.relative_to(folder).as_posix() for path in paths if not _is_answer(folder, path))


def _is_answer(folder: Path, path: Path) -> bool:
    return is_answer(path.name) and path.parent.parent == folder / SAMPLES_FOLDER
