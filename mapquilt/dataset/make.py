"""Making of a data set, which the same call resumes after an interruption."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mapping.io.atomic import write_bytes_atomically
from mapping.io.transaction import LEDGER_FILE, atomic_folder, refuse_links
from mapquilt.dataset.card import CARD_FILE, FIGURE_FILE, write_card
from mapquilt.dataset.carried_plans import CarriedPlans
from mapquilt.dataset.group import Group, Made, make_group
from mapquilt.dataset.manifest import (
    FAILURES_FILE,
    MANIFEST_FILE,
    MISSIONS_FOLDER,
    SAMPLES_FOLDER,
    SCHEMA,
    SPEC_FILE,
    Manifest,
    Record,
    is_dataset,
    lines_bytes,
    manifest_bytes,
    read_manifest,
)
from mapquilt.dataset.plan import DatasetPlan, MissionPlan, plan_dataset
from mapquilt.dataset.seal import SEAL_FILE, file_problem, seal_bytes
from mapquilt.dataset.spec import LICENCE
from mapquilt.jobs.code_version import code_version
from mapquilt.jobs.journal import JOURNAL_FILE, Entry, Journal, job_folder
from mapquilt.jobs.runner import Progress, Runner, no_progress
from mapquilt.json_file import check_record
from mapquilt.runs.folder import ANSWER_FILES


@dataclass(frozen=True)
class Report:
    """Hold the number of samples that were made, of those that failed, and of missions that missed their overlap."""

    samples: int
    failures: int
    missed: int = 0


def make_dataset(carried: CarriedPlans, out: Path, runner: Runner, on_progress: Progress = no_progress) -> Report:
    """Make a data set in a folder, or resume an unfinished one.

    Its plans are copied into the folder first, as world files, so that samples can be made again anywhere.

    Each folder is written atomically, and a synced journal lists the finished missions; the manifest is written last,
    after the seal of it and the other files at the top.
    Raises ``ValueError`` if the folder holds anything else or another specification, or if another process works in
    it, and ``OSError`` if it cannot be written.
    """
    plan = plan_dataset(carried.spec, carried.worlds)
    with job_folder(out, "data set of mapquilt", SPEC_FILE, carried.spec.model_dump_json(indent=2) + "\n"):
        for path, data in carried.files.items():
            refuse_links(out, (out / path).parent)
            (out / path).parent.mkdir(exist_ok=True)
            write_bytes_atomically(out / path, data)
        journal = Journal[MissionPlan](out / JOURNAL_FILE, lambda mission: str(mission.index))
        if is_dataset(out):
            manifest = read_manifest(out)
            _check_files(out, (*manifest.missions, *manifest.samples))
            journal.remove()
            return Report(len(manifest.samples), plan.samples - len(manifest.samples), missed_overlaps(manifest))
        made, failed = 0, 0

        def count(entries: Mapping[str, Entry]) -> None:
            nonlocal made, failed
            for entry in entries.values():
                made += sum(record["kind"] == "sample" for record in entry["records"])
                failed += len(entry["failures"])
            on_progress(made, failed)

        entries = journal.run(
            runner,
            make_group,
            plan.missions,
            lambda mission, result: _keep(out, mission, result),
            lambda mission, entry: is_whole(out, mission, entry),
            count,
        )
        return _finish(carried, plan, out, journal, tuple(entries.values()))


def is_whole(out: Path, mission: MissionPlan, entry: Entry) -> bool:
    """Check that an entry tells of every planned sample of a mission, and that all its files are as they were made.

    Raises ``ValueError`` naming the journal and the field if the entry is not one of a data set.
    """
    records, failures = entry.get("records"), entry.get("failures")
    place = Path(f"{out / JOURNAL_FILE}: task {mission.index}")
    if not isinstance(records, list) or not isinstance(failures, list):
        raise ValueError(f"{place}: lacks records or failures; delete the file, and all is made again")
    for record in records:
        check_record(place, "manifest", record)
    for failure in failures:
        check_record(place, "failures", failure)
    failed = {failure["sample"] for failure in failures}
    made = [("sample", sample.name) for sample in mission.samples if sample.name not in failed]
    found = [(record["kind"], record.get(record["kind"])) for record in records]
    if found != [("mission", mission.name), *made] and (found or made):
        return False
    return all(file_problem(path, digest) is None for path, digest in _files(out, records).items())


def _files(out: Path, records: Sequence[Record]) -> dict[Path, str]:
    """Return the hash of each file of the records."""
    return {_folder(out, record) / path: digest for record in records for path, digest in record["files"].items()}


def _check_files(out: Path, records: Sequence[Record]) -> None:
    """Raise ``FileNotFoundError`` naming the first file of the records that is not there."""
    for path in _files(out, records):
        if not path.is_file():
            raise FileNotFoundError(f"{path}: was removed after it was made")


def _folder(out: Path, record: dict[str, Any]) -> Path:
    kind = str(record["kind"])
    return out / {"mission": MISSIONS_FOLDER, "sample": SAMPLES_FOLDER}[kind] / str(record[kind])


def _keep(out: Path, mission: MissionPlan, result: Group | BaseException) -> Entry:
    """Write the folders of a group, each whole or not at all, and return the group's entry."""
    if isinstance(result, BaseException):
        failed = Made({}, None, f"mission {mission.name}: {result}")
        result = Group(failed, {sample.index: failed for sample in mission.samples})
    records = []
    for made in (result.mission, *result.samples.values()):
        if made.record is not None:
            refuse_links(out, _folder(out, made.record))
            _write_folder(_folder(out, made.record), made.files)
            records.append(made.record)
    failures = [
        {"sample": sample.name, "mission": mission.name, "reason": result.samples[sample.index].failure}
        for sample in mission.samples
        if result.samples[sample.index].failure is not None
    ]
    return {"records": records, "failures": failures}


def _write_folder(folder: Path, files: dict[str, bytes]) -> None:
    with atomic_folder(folder, stale=(*ANSWER_FILES, LEDGER_FILE)) as aside:
        for path, data in files.items():
            (aside / path).parent.mkdir(parents=True, exist_ok=True)
            write_bytes_atomically(aside / path, data)


def _finish(
    carried: CarriedPlans, plan: DatasetPlan, out: Path, journal: Journal[MissionPlan], entries: Sequence[Entry]
) -> Report:
    records = [record for entry in entries for record in entry["records"]]
    _check_files(out, records)
    failures = [failure for entry in entries for failure in entry["failures"]]
    if failures:
        write_bytes_atomically(out / FAILURES_FILE, lines_bytes(failures))
    manifest = build_manifest(carried, plan, records)
    write_card(out, carried.spec, manifest, len(failures))
    content = manifest_bytes(manifest)
    names = (SPEC_FILE, CARD_FILE, FIGURE_FILE, *([FAILURES_FILE] if failures else []))
    sealed = {MANIFEST_FILE: content} | {name: (out / name).read_bytes() for name in names}
    write_bytes_atomically(out / SEAL_FILE, seal_bytes(sealed))
    write_bytes_atomically(out / MANIFEST_FILE, content)
    journal.remove()
    return Report(plan.samples - len(failures), len(failures), missed_overlaps(manifest))


def missed_overlaps(manifest: Manifest) -> int:
    """Count the missions with a pair of whole maps whose overlap lies outside the range that was asked for."""
    wanted = {record["mission"]: record.get("overlap") for record in manifest.missions}
    missed = set()
    for sample in manifest.samples:
        bounds = wanted[sample["mission"]]
        if bounds is not None and sample["settings"]["parts"] == 1:
            low, high = bounds
            if not all(low <= pair["overlap"] <= high for pair in sample["pairs"]):
                missed.add(sample["mission"])
    return len(missed)


def build_manifest(carried: CarriedPlans, plan: DatasetPlan, records: Sequence[Record]) -> Manifest:
    """Build the manifest of a plan from the records of its finished groups, in order."""
    header = {
        "kind": "dataset",
        "schema": SCHEMA,
        "generator": f"mapquilt {version('mapquilt')}",
        "code": code_version(),
        "name": carried.spec.name,
        "seed": carried.spec.seed,
        "licence": LICENCE,
    }
    missions, samples = (
        tuple(record for record in records if record["kind"] == kind) for kind in ("mission", "sample")
    )
    made = {record["sample"] for record in samples}
    negatives = tuple(
        {
            "kind": "other_worlds",
            "split": pair.split,
            "target": {"sample": pair.target[0], "map": pair.target[1]},
            "source": {"sample": pair.source[0], "map": pair.source[1]},
        }
        for pair in plan.negatives
        if pair.target[0] in made and pair.source[0] in made
    )
    return Manifest(header, missions, samples, negatives, carried.records)
