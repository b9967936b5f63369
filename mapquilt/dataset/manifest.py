"""manifest.jsonl: one line per plan, mission, sample and negative pair, in order, with no times, hosts or absolute
paths."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mapping.io.safe_load import read_json_lines
from mapping.wording import did_you_mean
from mapquilt.dataset.seal import file_problem, read_seal
from mapquilt.json_file import check_record, present_record
from mapquilt.runs.folder import MANIFEST_FILE as MANIFEST_FILE

SPEC_FILE = "spec.json"
FAILURES_FILE = "failures.jsonl"
MISSIONS_FOLDER = "missions"
SAMPLES_FOLDER = "samples"
SCHEMA = "mapquilt-manifest/2"

Record = dict[str, Any]


@dataclass(frozen=True)
class Manifest:
    """Hold the header of a data set and the records of its missions, samples, negative pairs of two worlds, and plans
    that it carries."""

    header: Record
    missions: tuple[Record, ...]
    samples: tuple[Record, ...]
    negatives: tuple[Record, ...]
    plans: tuple[Record, ...] = ()


def is_dataset(folder: Path) -> bool:
    """Check if a folder is a finished data set."""
    return (folder / MANIFEST_FILE).is_file()


def manifest_bytes(manifest: Manifest) -> bytes:
    """Return the content of a manifest's file."""
    return lines_bytes((manifest.header, *manifest.plans, *manifest.missions, *manifest.samples, *manifest.negatives))


def lines_bytes(records: Iterable[Record]) -> bytes:
    """Format one record per line."""
    lines = (json.dumps(record, allow_nan=False, ensure_ascii=False) for record in records)
    return "".join(f"{line}\n" for line in lines).encode()


def read_manifest(folder: Path) -> Manifest:
    """Read the manifest of a finished data set, and check it against its seal, its schema and itself.

    Raises ``ValueError`` naming the file if it is missing or has changed, or the line or record that is wrong, and
    ``OSError`` otherwise.
    """
    manifest, path = parse_manifest(folder), folder / MANIFEST_FILE
    digest = read_seal(folder).get(MANIFEST_FILE)
    problem = None if digest is None else file_problem(path, digest)
    if problem is not None:
        raise ValueError(f"{path}: {problem} since the data set was made; mapquilt dataset verify {folder} tells more")
    for problem in contradictions(manifest):
        raise ValueError(f"{path}: {problem}")
    return manifest


def parse_manifest(folder: Path) -> Manifest:
    """Read the manifest, each line as its schema has it. Raises as ``read_manifest``."""
    path = folder / MANIFEST_FILE
    if not path.exists():
        raise ValueError(f"{path}: no such file; is {folder} a finished data set?")
    records = read_json_lines(path)
    records = [present_record(record, records[0].get("schema")) for record in records]
    if records[0].get("schema") != SCHEMA:
        raise ValueError(f"{path}: is not a manifest of schema {SCHEMA}")
    for number, record in enumerate(records, start=1):
        check_record(Path(f"{path}: line {number}"), "manifest", record)
        if (record["kind"] == "dataset") != (number == 1):
            raise ValueError(f"{path}: line {number}: the first line, and no other, must be the header")
    missions, samples, negatives, plans = (
        tuple(record for record in records if record["kind"] == kind)
        for kind in ("mission", "sample", "other_worlds", "plan")
    )
    return Manifest(records[0], missions, samples, negatives, plans)


def require_split(folder: Path, manifest: Manifest, split: str) -> None:
    """Raise ``ValueError`` naming the folder and its splits if a data set lacks a split."""
    splits = sorted({str(record["split"]) for record in manifest.samples})
    if split not in splits:
        raise ValueError(f"{folder}: has no split {split!r}, only {', '.join(splits)}{did_you_mean(split, splits)}")


def contradictions(manifest: Manifest) -> list[str]:
    """List one line for each record that is there twice, or names a mission, sample, map or split that is not there."""
    problems = []
    lines = Counter(json.dumps(record, sort_keys=True) for record in manifest.negatives)
    problems += [f"{line[:200]}: is there {count} times" for line, count in lines.items() if count > 1]
    for kind, key, records in (
        ("plan", "file", manifest.plans),
        ("mission", "mission", manifest.missions),
        ("sample", "sample", manifest.samples),
    ):
        names = Counter(record[key] for record in records)
        problems += [f"{kind} {name}: is there {count} times" for name, count in names.items() if count > 1]
    splits = {record["mission"]: record["split"] for record in manifest.missions}
    for record in manifest.samples:
        problems += [f"sample {record['sample']}: {problem}" for problem in _problems_of_sample(record, splits)]
    ends = {
        (record["sample"], one["name"]): (record["mission"], record["split"])
        for record in manifest.samples
        for one in record["maps"]
    }
    for record in manifest.negatives:
        places = [(end["sample"], end["map"]) for end in (record["target"], record["source"])]
        title = f"pair {' and '.join('/'.join(place) for place in places)}"
        problems += [f"{title}: there is no map {'/'.join(place)}" for place in places if place not in ends]
        found = [ends[place] for place in places if place in ends]
        if any(split != record["split"] for _, split in found):
            problems.append(f"{title}: is in the split {record['split']}, but its maps in others")
        if len(found) == 2 and found[0][0] == found[1][0]:
            problems.append(f"{title}: is of one mission, although it is called a negative pair")
    return problems


def _problems_of_sample(record: Record, splits: Mapping[str, str]) -> Iterator[str]:
    mission, split = record["mission"], record["split"]
    if mission not in splits:
        yield f"there is no mission {mission}"
    elif split != splits[mission]:
        yield f"is in the split {split}, but its mission {mission} in {splits[mission]}"
    robots = {one["name"]: one["robot"] for one in record["maps"]}
    if len(robots) < len(record["maps"]):
        yield "names a map twice"
    for one in record["maps"]:
        if one["file"] != f"{one['name']}/map.yaml" or one["file"] not in record["files"]:
            yield f"the file of map {one['name']} is {one['file']}, of which it has no hash"
    names = Counter(frozenset((pair["target"], pair["source"])) for pair in record["pairs"])
    for ends, count in names.items():
        if count > 1:
            yield f"the pair {' and '.join(sorted(ends))} is there {count} times"
        if len({robots.get(name) for name in ends} - {None}) < 2:
            yield f"the pair {' and '.join(sorted(ends))} is not of maps of two robots"
