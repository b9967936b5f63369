"""Files of a run that hold its maps, logs and truth."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import Any

from mapping.io.map_file import save_map
from mapping.io.robot_log_file import save_robot_log
from mapping.io.transaction import write_files_atomically
from mapquilt.json_file import write_record
from mapquilt.runs import folder as run_folder
from mapquilt.runs.sample import Sample, lidar_names
from mapquilt.runs.truth_file import save_truth
from mapquilt.settings import SampleSettings
from sim.mission.mission import Mission

RUN_SCHEMA = "mapquilt-run/2"
MAPS_SCHEMA = "mapquilt-maps/1"


def fill_run(
    folder: Path,
    mission: Mission,
    settings: SampleSettings,
    sample: Sample,
    mission_path: str = run_folder.MISSION_FOLDER,
) -> None:
    """Write a sample's maps, logs and truth into a folder; ``mission_path`` is the relative path to its mission."""
    write_record(folder / run_folder.RUN_FILE, "run", _run_record(mission, settings, sample, mission_path))
    _write_maps(folder, sample)
    save_truth(folder / run_folder.TRUTH_FILE, sample.truth)
    _write_true_rasters(folder / run_folder.TRUTH_FOLDER, sample)


def _run_record(mission: Mission, settings: SampleSettings, sample: Sample, mission_path: str) -> dict[str, Any]:
    return {
        "schema": RUN_SCHEMA,
        "generator": f"mapquilt {version('mapquilt')}",
        "mission": mission_path,
        "world": mission.world.name,
        "seed": mission.seed,
        "robots": len(mission.robots),
        "duration_s": mission.settings.duration,
        "starts": mission.settings.starts,
        "drive": mission.settings.drive,
        "policy": mission.settings.policy,
        "overlap": _overlap_record(mission, sample),
        "sample_seed": settings.seed,
        "lidars": list(lidar_names(mission)),
        "noise": settings.sensing.noise,
        "noise_components": dict(settings.sensing.components),
        "poses": settings.mapping.pose_source,
        "frame_perturbation": {
            "scale": [settings.perturbation.scale_low, settings.perturbation.scale_high],
            "max_yaw": settings.perturbation.max_yaw,
            "max_offset": settings.perturbation.max_offset,
        },
        "resolution_m": settings.mapping.resolution,
        "sensor_model": settings.mapping.cell_model,
        "clear_range_m": settings.mapping.clear_range,
        "parts": settings.parts,
    }


def _overlap_record(mission: Mission, sample: Sample) -> dict[str, Any]:
    overlaps = sample.true_overlaps().values()
    wanted = mission.settings.overlap
    return {
        "wanted": None if wanted is None else list(wanted),
        "reached": [min(overlaps), max(overlaps)] if overlaps else None,
        "ends_s": [float(truth.trajectory.stamps[-1]) for truth in mission.robots],
    }


def _write_maps(folder: Path, sample: Sample) -> None:
    entries = []
    for name, grid, log in zip(sample.maps.names, sample.maps.grids, sample.logs, strict=True):
        (folder / name).mkdir()
        save_map(grid, folder / name / "map")
        save_robot_log(folder / name / run_folder.LOG_FILE, log)
        entries.append({"name": name, "file": f"{name}/map.yaml"})
    record = {
        "schema": MAPS_SCHEMA,
        "resolutions_trusted": sample.maps.resolutions_trusted,
        "provenance": dict(sample.maps.provenance),
        "maps": entries,
    }
    write_record(folder / run_folder.MAPS_FILE, "maps", record)


def _write_true_rasters(folder: Path, sample: Sample) -> None:
    folder.mkdir()
    for files in sample.places.raster_files.values():
        write_files_atomically({folder / name: data for name, data in files.items()})
