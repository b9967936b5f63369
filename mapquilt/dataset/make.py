"""Making a data set: nothing is lost, whatever stops it, and the same specification gives the same bytes."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mapping.io.atomic import folder_aside, write_bytes_aside
from mapquilt.dataset.card import write_card
from mapquilt.dataset.group import MISSIONS_FOLDER, SAMPLES_FOLDER, Group, Made, make_group
from mapquilt.dataset.manifest import MANIFEST_FILE, build_manifest, read_manifest, write_lines, write_manifest
from mapquilt.dataset.plan import DatasetPlan, MissionPlan, plan_dataset
from mapquilt.dataset.spec import DatasetSpec
from mapquilt.jobs.executor import MakeExecutor, run_all
from mapquilt.jobs.journal import LOCK_FILE, Journal, locked

SPEC_FILE = "spec.json"
FAILURES_FILE = "failures.jsonl"

Progress = Callable[[int, int], None]
"""Called with how many samples are done and how many failed."""


@dataclass(frozen=True)
class Report:
    """How many samples a data set has, and how many could not be made."""

    samples: int
    failures: int


def make_dataset(
    spec: DatasetSpec,
    out: Path,
    make_executor: MakeExecutor,
    workers: int,
    on_progress: Progress = lambda done, failed: None,
) -> Report:
    """Make a data set in a folder, or go on with one that was begun.

    Groups of samples appear whole, and a synced journal says which are done; the manifest is written last, in order.
    Raises ``ValueError`` where the folder holds anything else, another specification, or another process at work,
    ``OSError`` where it cannot be written; what was finished stays, and the same call goes on from there.
    """
    plan = plan_dataset(spec)
    _claim(out, spec)
    with locked(out):
        if (out / MANIFEST_FILE).exists():
            manifest = read_manifest(out)
            return Report(len(manifest.samples), plan.samples - len(manifest.samples))
        _clear_leftovers(out)
        journal = Journal(out)
        entries = {entry["group"]: entry for entry in journal.entries() if _is_whole(out, entry)}
        _go_on(plan, out, journal, entries, make_executor, workers, on_progress)
        return _finish(spec, plan, out, journal, entries)


def _claim(out: Path, spec: DatasetSpec) -> None:
    text = spec.model_dump_json(indent=2) + "\n"
    path = out / SPEC_FILE
    if path.exists():
        if path.read_text(encoding="utf-8") != text:
            raise ValueError(f"{out}: holds a data set of another specification; name another folder")
        return
    if out.exists() and any(child.name != LOCK_FILE for child in out.iterdir()):
        raise ValueError(f"{out}: is not empty and not a data set of mapquilt; refusing to write into it")
    out.mkdir(parents=True, exist_ok=True)
    write_bytes_aside(path, text.encode())


def _clear_leftovers(out: Path) -> None:
    """Take away what a killed process left half-written; the lock is held, so nobody is writing it."""
    for path in [*out.glob(".*.part"), *out.glob("*/.*.part"), *out.glob("*/.*.old")]:
        shutil.rmtree(path) if path.is_dir() else path.unlink()


def _is_whole(out: Path, entry: dict[str, Any]) -> bool:
    return all(
        (folder / path).is_file() and hashlib.sha256((folder / path).read_bytes()).hexdigest() == digest
        for record in entry["records"]
        for folder in [_folder(out, record)]
        for path, digest in record["files"].items()
    )


def _folder(out: Path, record: dict[str, Any]) -> Path:
    kind = str(record["kind"])
    return out / {"mission": MISSIONS_FOLDER, "sample": SAMPLES_FOLDER}[kind] / str(record[kind])


def _go_on(
    plan: DatasetPlan,
    out: Path,
    journal: Journal,
    entries: dict[int, dict[str, Any]],
    make_executor: MakeExecutor,
    workers: int,
    on_progress: Progress,
) -> None:
    def tell() -> None:
        failed = sum(len(entry["failures"]) for entry in entries.values())
        records = (record for entry in entries.values() for record in entry["records"])
        on_progress(sum(record["kind"] == "sample" for record in records), failed)

    tell()
    missing = [mission for mission in plan.missions if mission.index not in entries]
    with closing(run_all(make_executor, make_group, missing, workers)) as results:
        for mission, result in results:
            entry = _keep(out, mission, result)
            journal.add(entry)
            entries[mission.index] = entry
            tell()


def _keep(out: Path, mission: MissionPlan, result: Group | BaseException) -> dict[str, Any]:
    """Write a group's folders, each aside and renamed, and say what there is of it."""
    if isinstance(result, OSError | MemoryError):
        raise result  # the machine's fault, not the sample's: to be tried again
    if isinstance(result, BaseException):
        failed = Made({}, None, f"{type(result).__name__}: {result}")
        result = Group(failed, {sample.index: failed for sample in mission.samples})
    records = []
    for made in (result.mission, *result.samples.values()):
        if made.record is not None:
            _write_folder(_folder(out, made.record), made.files)
            records.append(made.record)
    failures = [
        {"sample": sample.name, "mission": mission.name, "reason": result.samples[sample.index].failure}
        for sample in mission.samples
        if result.samples[sample.index].failure is not None
    ]
    return {"group": mission.index, "records": records, "failures": failures}


def _write_folder(folder: Path, files: dict[str, bytes]) -> None:
    with folder_aside(folder) as aside:
        for path, data in files.items():
            (aside / path).parent.mkdir(parents=True, exist_ok=True)
            write_bytes_aside(aside / path, data)


def _finish(
    spec: DatasetSpec, plan: DatasetPlan, out: Path, journal: Journal, entries: dict[int, dict[str, Any]]
) -> Report:
    in_order = [entries[mission.index] for mission in plan.missions]
    failures = [failure for entry in in_order for failure in entry["failures"]]
    if failures:
        write_lines(out / FAILURES_FILE, failures)
    manifest = build_manifest(spec, plan, [record for entry in in_order for record in entry["records"]])
    write_card(out, spec, manifest, len(failures))
    write_manifest(out, manifest)
    journal.remove()
    return Report(plan.samples - len(failures), len(failures))
