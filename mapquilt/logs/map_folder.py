"""Folders of maps that were drawn from logs: of one map, or of several as a run, with the truth where it is known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mapping.io.atomic import write_bytes_atomically
from mapping.io.map_file import save_map
from mapping.io.robot_log_file import save_robot_log
from mapping.io.transaction import atomic_folder
from mapping.io.tum import save_tum
from mapping.slam.g2o import g2o_text
from mapquilt.json_file import write_record
from mapquilt.logs.log_map import LOG_SEED, LogMap
from mapquilt.logs.map_figure import map_figure
from mapquilt.logs.map_record import MAP_RECORD, save_map_record
from mapquilt.logs.reference_truth import ReferenceTruth, reference_truth, share_a_reference
from mapquilt.runs import folder as run_folder
from mapquilt.runs.truth_file import save_truth
from mapquilt.runs.writer import MAPS_SCHEMA, RUN_SCHEMA
from mapquilt.viz.png import figure_png

GRAPH_FILE = "graph.g2o"
SHEET_FILE = "maps.png"


def refuse_map_folder(out: Path, several: bool) -> None:
    """Raise ``ValueError`` if writing there would overwrite files of others; an older folder of maps is replaced."""
    run_folder.refuse_foreign(out, run_folder.RUN_FILE if several else MAP_RECORD)


def write_log_map(out: Path, drawn: LogMap) -> None:
    """Write the folder of one map, whole or not at all."""
    refuse_map_folder(out, several=False)
    with atomic_folder(out, ledger=True) as folder:
        _fill(folder, drawn)


def write_log_run(out: Path, maps: Sequence[LogMap], parts: int, on_step: Callable[[], None] = lambda: None) -> None:
    """Write several maps as a run, which ``merge`` merges, whole or not at all.

    If they are of one log with reference poses, the truth is written as for a simulated run, and ``score`` reads it.
    ``on_step`` is called after each step of the truth.
    """
    refuse_map_folder(out, several=True)
    truth = reference_truth(maps, on_step) if share_a_reference(maps) else None
    with atomic_folder(out, ledger=True) as folder:
        write_record(folder / run_folder.RUN_FILE, "run", _run_record(maps, parts, truth))
        write_record(folder / run_folder.MAPS_FILE, "maps", _maps_record(maps))
        write_bytes_atomically(folder / SHEET_FILE, figure_png(_sheet(maps)))
        for one in maps:
            (folder / one.name).mkdir()
            _fill(folder / one.name, one)
            save_robot_log(folder / one.name / run_folder.LOG_FILE, one.recorded.log)
        if truth is not None:
            save_truth(folder / run_folder.TRUTH_FILE, truth.truth)
            _write_reference(folder / run_folder.TRUTH_FOLDER, maps, truth)


def _fill(folder: Path, drawn: LogMap) -> None:
    save_map(drawn.grid, folder / "map")
    save_tum(folder / run_folder.TRAJECTORY_FILE, drawn.result.trajectory)
    if drawn.result.edges:
        write_bytes_atomically(folder / GRAPH_FILE, g2o_text(drawn.result).encode())
    write_bytes_atomically(folder / run_folder.LOG_MAP_PICTURE, figure_png(map_figure(drawn)))
    save_map_record(folder / MAP_RECORD, drawn)
    if drawn.result.timings:
        run_folder.add_timings(folder, "map", drawn.result.timings)


def _sheet(maps: Sequence[LogMap]) -> Any:
    from mapquilt.viz.log_map_picture import log_maps_figure

    paths = [one.result.trajectory.poses[:, :2] for one in maps]
    return log_maps_figure([one.name for one in maps], [one.grid for one in maps], paths)


def _maps_record(maps: Sequence[LogMap]) -> dict[str, Any]:
    return {
        "schema": MAPS_SCHEMA,
        "resolutions_trusted": True,
        "provenance": {"source": "logs", "world": _world(maps)},
        "maps": [{"name": one.name, "file": f"{one.name}/map.yaml"} for one in maps],
    }


def _world(maps: Sequence[LogMap]) -> str:
    return ", ".join(dict.fromkeys(one.path.name for one in maps))


def _run_record(maps: Sequence[LogMap], parts: int, truth: ReferenceTruth | None) -> dict[str, Any]:
    """Describe the maps as a run that no mission made."""
    settings = maps[0].settings
    stamps = [one.recorded.log.odometry.stamps for one in maps]
    overlaps = [] if truth is None else [pair.footprints.overlap for pair in truth.truth.pairs.values()]
    return {
        "schema": RUN_SCHEMA,
        "generator": f"mapquilt {version('mapquilt')}",
        "mission": None,
        "world": _world(maps),
        "seed": 0,
        "robots": len(maps) // parts,
        "duration_s": max(float(times[-1] - times[0]) for times in stamps),
        "starts": None,
        "drive": None,
        "policy": None,
        "overlap": {
            "wanted": None,
            "reached": [min(overlaps), max(overlaps)] if overlaps else None,
            "ends_s": [float(times[-1]) for times in stamps],
        },
        "lidars": [],
        "noise": None,
        "noise_components": {},
        "poses": settings.pose_source,
        "frame_perturbation": {"scale": [1.0, 1.0], "max_yaw": 0.0, "max_offset": 0.0},
        "resolution_m": settings.resolution,
        "sensor_model": settings.cell_model,
        "clear_range_m": settings.clear_range,
        "sample_seed": LOG_SEED,
        "parts": parts,
    }


def _write_reference(folder: Path, maps: Sequence[LogMap], truth: ReferenceTruth) -> None:
    """Write the true rasters and the reference trajectories, which the merger never reads."""
    folder.mkdir()
    save_map(truth.world, folder / "world", picture="png")
    for one in maps:
        save_map(truth.footprints[one.name], folder / one.name, picture="png")
        if one.recorded.reference is not None:
            save_tum(folder / f"{one.name}.tum", one.recorded.reference)
