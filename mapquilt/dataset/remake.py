"""Reproduction of one sample of a data set."""

from __future__ import annotations

import dataclasses
import hashlib
from pathlib import Path

from mapping.io.atomic import write_bytes_atomically
from mapping.io.transaction import atomic_folder
from mapquilt.dataset.carried_plans import carry_plans
from mapquilt.dataset.group import Made, make_group
from mapquilt.dataset.manifest import MISSIONS_FOLDER, SAMPLES_FOLDER, SPEC_FILE, read_manifest
from mapquilt.dataset.plan import MissionPlan, plan_dataset
from mapquilt.dataset.spec import load_spec


def remake_sample(folder: Path, name: str, out: Path) -> list[str]:
    """Make a sample and its mission again under ``out``, and return the paths that differ from the manifest's hashes.

    Raises ``ValueError`` if the data set has no such sample, or if ``out`` is not empty.
    """
    if out.exists() and any(out.iterdir()):
        raise ValueError(f"{out}: is not empty")
    expected = {record["sample"]: record["files"] for record in read_manifest(folder).samples}
    if name not in expected:
        raise ValueError(f"{folder}: has no sample {name!r}")
    plan = _plan_of(folder, name)
    group = make_group(plan)
    (sample,) = group.samples.values()
    if sample.failure is not None:
        raise ValueError(f"{name}: cannot be made again: {sample.failure}")
    with atomic_folder(out) as aside:
        _write(aside / MISSIONS_FOLDER / plan.name, group.mission)
        _write(aside / SAMPLES_FOLDER / name, sample)
    made = {path: hashlib.sha256(data).hexdigest() for path, data in sample.files.items()}
    return sorted(path for path in made.keys() | expected[name].keys() if made.get(path) != expected[name].get(path))


def _plan_of(folder: Path, name: str) -> MissionPlan:
    carried = carry_plans(load_spec(str(folder / SPEC_FILE)), folder)
    plan = plan_dataset(carried.spec, carried.worlds)
    mission = next(mission for mission in plan.missions if any(sample.name == name for sample in mission.samples))
    return dataclasses.replace(mission, samples=tuple(sample for sample in mission.samples if sample.name == name))


def _write(folder: Path, made: Made) -> None:
    for path, data in made.files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        write_bytes_atomically(folder / path, data)
