"""Verification of a data set: its manifest by its seal, truth and specification, its files by their hashes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from mapping.io.safe_load import read_json_lines
from mapquilt.dataset.card import CARD_FILE, FIGURE_FILE
from mapquilt.dataset.carried_plans import PLANS_FOLDER
from mapquilt.dataset.manifest import (
    FAILURES_FILE,
    MANIFEST_FILE,
    MISSIONS_FOLDER,
    SAMPLES_FOLDER,
    SPEC_FILE,
    Manifest,
    Record,
    contradictions,
    parse_manifest,
)
from mapquilt.dataset.seal import SEAL_FILE, file_problem, read_seal
from mapquilt.dataset.spec import load_spec
from mapquilt.json_file import check_record, read_record
from mapquilt.runs.folder import TRUTH_FILE, is_answer
from sim.mission.file import WORLD_FILE
from worlds.world_file import world_from_json

REPORT_FILE = "report.html"
"""Page that ``mapquilt report`` adds to a data set."""


def verify_dataset(folder: Path, on_progress: Callable[[int, int], None] = lambda done, total: None) -> list[str]:
    """List one line for each fault of a data set, and vouch for all that a loader reads if there is none.

    Its manifest, specification, card and figures are compared with the digests of its seal, its records with each
    other, with the number of samples and the splits of the specification, and its files with the hashes of the records.
    If all agree, true transforms and overlaps are compared with the truth of each sample, and worlds with each other:
    none may be in two splits, and no negative pair may show one world.

    Files that ``mapquilt merge``, ``score`` and ``report`` add are ignored, and hidden ones at the top. Raises
    ``ValueError`` if the folder is not a finished data set, or a line of its manifest is not one of the schema.
    """
    manifest, seal = parse_manifest(folder), read_seal(folder)
    expected = {
        f"{place}/{record[kind]}/{path}": digest
        for place, kind, records in (
            (MISSIONS_FOLDER, "mission", manifest.missions),
            (SAMPLES_FOLDER, "sample", manifest.samples),
        )
        for record in records
        for path, digest in record["files"].items()
    } | {record["file"]: record["sha256"] for record in manifest.plans}
    problems = [
        f"{name}: is not vouched for by {SEAL_FILE}"
        for name in (MANIFEST_FILE, SPEC_FILE, CARD_FILE, FIGURE_FILE)
        if name not in seal
    ]
    problems += [f"{MANIFEST_FILE}: {problem}" for problem in contradictions(manifest)]
    for done, (path, digest) in enumerate((seal | expected).items(), start=1):
        problem = file_problem(folder / path, digest)
        if problem is not None:
            problems.append(f"{path}: {problem}")
        on_progress(done, len(seal) + len(expected))
    problems += [f"{path}: is in no record" for path in _found(folder, set(seal)) if path not in expected]
    if not any(problem.startswith((f"{SPEC_FILE}: ", f"{FAILURES_FILE}: ")) for problem in problems):
        problems += _unplanned(folder, manifest)
    return problems or [*_wrong_labels(folder, manifest), *_shared_worlds(folder, manifest)]


def _unplanned(folder: Path, manifest: Manifest) -> list[str]:
    """Compare the samples and splits of a manifest with its specification."""
    spec, failures = load_spec(str(folder / SPEC_FILE)), folder / FAILURES_FILE
    failed = []
    for number, record in enumerate(read_json_lines(failures) if failures.is_file() else [], start=1):
        check_record(Path(f"{failures}: line {number}"), "failures", record)
        failed.append(record["sample"])
    made = [record["sample"] for record in manifest.samples]
    told = {int(name) for name in (*made, *failed)}
    problems = [
        f"{SAMPLES_FOLDER}/{name}: was made, but {FAILURES_FILE} says that it failed" for name in failed if name in made
    ]
    foreign = sorted(number for number in told if number >= spec.total)
    problems += [f"{SAMPLES_FOLDER}/{number:06d}: is no sample of {SPEC_FILE}" for number in foreign]
    missing = spec.total - len(told) + len(foreign)
    if missing:
        first = next(number for number in range(spec.total) if number not in told)
        problems.append(
            f"{SAMPLES_FOLDER}/{first:06d}: is missing, the first of {missing} of {spec.total} planned samples"
        )
    splits = {record["split"] for record in (*manifest.missions, *manifest.samples)}
    problems += [f"split {name}: is none of {SPEC_FILE}" for name in sorted(splits - spec.splits.keys())]
    return problems


def _wrong_labels(folder: Path, manifest: Manifest) -> list[str]:
    """Compare the maps and pairs of each sample's record with its truth."""
    problems = []
    for record in manifest.samples:
        truth = read_record(folder / SAMPLES_FOLDER / record["sample"] / TRUTH_FILE, "truth")
        robot = {one["name"]: one["robot"] for one in record["maps"]}
        maps = {one["name"]: (one["world_from_map"], one["distortion_m"]) for one in record["maps"]}
        true_maps = {one["name"]: (one["world_from_map"], one["distortion_m"]) for one in truth["robots"]}
        problems += [
            f"{SAMPLES_FOLDER}/{record['sample']}/{name}: is another map in {MANIFEST_FILE} than in {TRUTH_FILE}"
            for name in sorted(maps.keys() | true_maps.keys())
            if maps.get(name) != true_maps.get(name)
        ]
        pairs = {(pair["target"], pair["source"]): pair for pair in record["pairs"]}
        true_pairs = {
            (pair["target"], pair["source"]): pair
            for pair in truth["pairs"]
            if robot.get(pair["target"]) != robot.get(pair["source"])
        }
        problems += [
            f"{SAMPLES_FOLDER}/{record['sample']}: the pair {target} and {source} is another in {MANIFEST_FILE} "
            f"than in {TRUTH_FILE}"
            for target, source in sorted(pairs.keys() | true_pairs.keys())
            if pairs.get((target, source)) != true_pairs.get((target, source))
        ]
    return problems


def _shared_worlds(folder: Path, manifest: Manifest) -> list[str]:
    worlds = {
        record["mission"]: world_from_json(
            read_record(folder / MISSIONS_FOLDER / record["mission"] / WORLD_FILE, "world")
        )
        for record in manifest.missions
    }
    content = {mission: world.fingerprint for mission, world in worlds.items()}
    first: dict[str, Record] = {}
    problems = [
        f"{MISSIONS_FOLDER}/{record['mission']}: is in another world than {MANIFEST_FILE} says"
        for record in manifest.missions
        if record.get("fingerprint", content[record["mission"]]) != content[record["mission"]]
    ]
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


def _found(folder: Path, sealed: set[str]) -> list[str]:
    """List the files and links that no merge, score or report adds, but hidden ones at the top."""
    top = [path for path in folder.iterdir() if not path.name.startswith(".")]
    places = {MISSIONS_FOLDER, SAMPLES_FOLDER, PLANS_FOLDER}
    own = {MANIFEST_FILE, SPEC_FILE, CARD_FILE, FIGURE_FILE, SEAL_FILE, REPORT_FILE} | sealed
    paths = [path for path in top if path.name not in own and (path.name not in places or path.is_symlink())]
    paths += [
        path
        for place in places
        for path in (folder / place).rglob("*")
        if (path.is_symlink() or not path.is_dir()) and not _is_answer(folder, path)
    ]
    return sorted(path.relative_to(folder).as_posix() for path in paths)


def _is_answer(folder: Path, path: Path) -> bool:
    return is_answer(path.name) and path.parent.parent == folder / SAMPLES_FOLDER
