"""Published data sets: digests of their records, to compare with a data set that was made again."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from mapping.wording import did_you_mean
from mapquilt.dataset.manifest import SPEC_FILE, Manifest, Record, lines_bytes, read_manifest

PUBLISHED_FILE = "published.json"
DIGITS = 12
"""Hexadecimal digits of the digest of one record, which says where two data sets differ."""


@dataclass(frozen=True)
class Differences:
    """Hold the program that made the published data set, and one line for each record that differs from it."""

    generator: str
    lines: tuple[str, ...]


def published_record(folder: Path) -> dict[str, Any]:
    """Digest a finished data set.

    ``digest`` is the SHA-256 of the manifest, which holds the hash of every file, without the version of the code;
    ``spec`` that of the specification; ``records`` has a short digest of each mission and sample. Raises as
    ``read_manifest``.
    """
    manifest = read_manifest(folder)
    return {
        "generator": manifest.header["generator"],
        "spec": hashlib.sha256((folder / SPEC_FILE).read_bytes()).hexdigest(),
        "digest": manifest_digest(manifest),
        "pairs": sum(len(sample["pairs"]) for sample in manifest.samples),
        "other_worlds": len(manifest.negatives),
        "records": {
            **{f"missions/{record['mission']}": _digest(record)[:DIGITS] for record in manifest.missions},
            **{f"samples/{record['sample']}": _digest(record)[:DIGITS] for record in manifest.samples},
        },
    }


def manifest_digest(manifest: Manifest) -> str:
    """Hash a manifest without the version of the program and its sources: equal digests, equal data."""
    header = {key: value for key, value in manifest.header.items() if key not in ("generator", "code")}
    records = (header, *manifest.plans, *manifest.missions, *manifest.samples, *manifest.negatives)
    return hashlib.sha256(lines_bytes(records)).hexdigest()


def _digest(record: Record) -> str:
    return hashlib.sha256(lines_bytes([record])).hexdigest()


def published_records() -> dict[str, dict[str, Any]]:
    """Return the records of all published data sets, by name."""
    text = (resources.files("mapquilt.dataset") / PUBLISHED_FILE).read_text(encoding="utf-8")
    return dict(json.loads(text))


def differences(folder: Path) -> Differences:
    """Compare a data set with the published one of its name.

    Raises ``ValueError`` if none of its name is published, or it has another specification; else as ``read_manifest``.
    """
    known, name = published_records(), str(read_manifest(folder).header["name"])
    if name not in known:
        raise ValueError(
            f"{folder}: no data set {name!r} is published, only {', '.join(known)}{did_you_mean(name, known)}"
        )
    published, own = known[name], published_record(folder)
    if own["spec"] != published["spec"]:
        raise ValueError(
            f"{folder / SPEC_FILE}: is another specification than that of the published data set {name!r}; make it by "
            f"mapquilt dataset make {name} --out DIR"
        )
    names = dict.fromkeys([*published["records"], *own["records"]])
    lines = [
        f"{name}: {_difference(published['records'].get(name), own['records'].get(name))}"
        for name in names
        if published["records"].get(name) != own["records"].get(name)
    ]
    if not lines and own["digest"] != published["digest"]:
        lines = ["manifest.jsonl: its header, plans or pairs of two worlds are others than the published ones"]
    return Differences(published["generator"], tuple(lines))


def _difference(published: str | None, own: str | None) -> str:
    if own is None:
        return "is missing"
    return "is not in the published data set" if published is None else "differs from the published one"
