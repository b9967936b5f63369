"""One mission and all its samples, made by one worker and returned as bytes: the unit of parallel work."""

from __future__ import annotations

import dataclasses
import hashlib
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mapping.io.atomic import write_bytes_atomically
from mapquilt.dataset.manifest import MISSIONS_FOLDER
from mapquilt.dataset.plan import MissionPlan, SamplePlan
from mapquilt.dataset.preview import preview_png
from mapquilt.json_file import read_record
from mapquilt.runs import folder as run_folder
from mapquilt.runs.open_world import open_world
from mapquilt.runs.sample import Sample, make_sample
from mapquilt.runs.true_footprints import ObservedSlices, TrueFootprints, true_footprints
from mapquilt.runs.writer import fill_run
from sim.mission.file import save_mission
from sim.mission.mission import Mission
from sim.mission.simulation import simulate

PREVIEW_PICTURE = "preview.png"

Files = dict[str, bytes]


@dataclass(frozen=True)
class Made:
    """Hold the files of one folder by path and its record in the manifest, or the reason for a failure."""

    files: Files
    record: dict[str, Any] | None
    failure: str | None = None


@dataclass(frozen=True)
class Group:
    """Hold a mission and its samples by index. If the mission failed, so did its samples."""

    mission: Made
    samples: dict[int, Made]


def make_group(plan: MissionPlan) -> Group:
    """Simulate a mission and make its samples; the result depends on the plan alone.

    A sample that fails holds the reason, and the others continue.
    """
    try:
        mission = _simulate(plan)
    except ValueError as error:
        failed = Made({}, None, f"mission {plan.name}: {error}")
        return Group(failed, {sample.index: failed for sample in plan.samples})
    settings = [sample.settings for sample in plan.samples]
    seen = ObservedSlices(mission, {one.parts for one in settings}, settings[0].mapping.clear_range)
    places: dict[int, TrueFootprints] = {}
    samples = {sample.index: _make_sample(plan, sample, mission, seen, places) for sample in plan.samples}
    return Group(_made_mission(plan, mission), samples)


def _simulate(plan: MissionPlan) -> Mission:
    spec = plan.missions
    world = plan.world or open_world(spec.world, plan.seed, spec.width, spec.height, spec.plan)[0]
    clear_range = plan.samples[0].settings.mapping.clear_range
    return simulate(world, spec.settings(), plan.seed, clear_range=clear_range)[0]


def _made_mission(plan: MissionPlan, mission: Mission) -> Made:
    with tempfile.TemporaryDirectory() as folder:
        save_mission(mission, Path(folder))
        files = _read_files(Path(folder))
    record = {
        "kind": "mission",
        "mission": plan.name,
        "split": plan.split,
        "world": plan.missions.place,
        "licence": plan.missions.licence,
        "fingerprint": mission.world.fingerprint,
        "seed": plan.seed,
        "robots": plan.missions.robots,
        "duration_s": plan.missions.duration,
        "overlap": plan.missions.overlap,
        "files": _hashes(files),
    }
    return Made(files, record)


def _make_sample(
    plan: MissionPlan, sample: SamplePlan, mission: Mission, seen: ObservedSlices, places: dict[int, TrueFootprints]
) -> Made:
    settings = sample.settings
    try:
        if settings.parts not in places:
            places[settings.parts] = true_footprints(mission, settings.parts, seen)
        made = make_sample(mission, settings, places[settings.parts])
    except ValueError as error:
        return Made({}, None, str(error))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        fill_run(folder, mission, settings, made, f"../../{MISSIONS_FOLDER}/{plan.name}")
        write_bytes_atomically(folder / PREVIEW_PICTURE, preview_png(made.maps))
        files = _read_files(folder)
        truth = read_record(folder / run_folder.TRUTH_FILE, "truth")
    record = {
        "kind": "sample",
        "sample": sample.name,
        "mission": plan.name,
        "split": plan.split,
        "world": plan.missions.place,
        "seed": settings.seed,
        "settings": _settings_record(sample),
        "maps": _map_records(made, truth),
        "pairs": _pair_records(made, truth),
        "files": _hashes(files),
    }
    return Made(files, record)


def _settings_record(sample: SamplePlan) -> dict[str, Any]:
    settings = sample.settings
    return {
        "noise": settings.sensing.noise,
        "poses": settings.mapping.pose_source,
        "frame_perturbation": dataclasses.asdict(settings.perturbation),
        "resolution": settings.mapping.resolution,
        "model": settings.mapping.cell_model,
        "clear_range": settings.mapping.clear_range,
        "parts": settings.parts,
        "components": settings.sensing.components,
    }


def _map_records(made: Sample, truth: dict[str, Any]) -> list[dict[str, Any]]:
    robots = {entry["name"]: entry for entry in truth["robots"]}
    return [
        {
            "name": place.name,
            "robot": place.robot,
            "file": f"{place.name}/map.yaml",
            "world_from_map": robots[place.name]["world_from_map"],
            "distortion_m": robots[place.name]["distortion_m"],
        }
        for place in made.places.maps
    ]


def _pair_records(made: Sample, truth: dict[str, Any]) -> list[dict[str, Any]]:
    """Select the pairs of maps of different robots."""
    robot = {place.name: place.robot for place in made.places.maps}
    return [pair for pair in truth["pairs"] if robot[pair["target"]] != robot[pair["source"]]]


def _read_files(folder: Path) -> Files:
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def _hashes(files: Files) -> dict[str, str]:
    return {path: hashlib.sha256(data).hexdigest() for path, data in files.items()}
