"""map.json: the record of a map that was drawn from a log."""

from __future__ import annotations

import dataclasses
import math
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from mapping.geometry.se2 import SE2
from mapping.settings import MappingSettings
from mapping.slam.result import Edge
from mapquilt.evaluation.trajectory_error import AbsoluteError, Spread
from mapquilt.json_file import write_record
from mapquilt.leaves import changed_leaves
from mapquilt.logs.log_map import LogMap

SCHEMA = "mapquilt-map/1"
MAP_RECORD = "map.json"


def save_map_record(path: Path, drawn: LogMap) -> None:
    """Write the record of a map, checked against its schema."""
    write_record(path, "map", map_record(drawn))


def map_record(drawn: LogMap) -> dict[str, Any]:
    """Describe a map: its log, its settings, the keyframes and loops, and its error against the reference."""
    log, result, settings = drawn.recorded.log, drawn.result, drawn.settings
    stamps = log.odometry.stamps
    error = drawn.error
    return {
        "schema": SCHEMA,
        "generator": f"mapquilt {version('mapquilt')}",
        "name": drawn.name,
        "log": drawn.path.name,
        "warnings": list(drawn.recorded.warnings),
        "has_odometry": drawn.recorded.has_odometry,
        "scans": len(log.scans),
        "beams": int(log.scans[0].ranges.size),
        "start_s": float(stamps[0]),
        "duration_s": float(stamps[-1] - stamps[0]),
        "path_m": result.trajectory.distance(),
        "poses": drawn.poses,
        "resolution_m": settings.resolution,
        "sensor_model": settings.cell_model,
        "clear_range_m": settings.clear_range,
        "settings": _plain(changed_leaves(settings, MappingSettings(settings.poses))),
        "keyframes": result.keyframes.tolist(),
        "edges": len(result.edges),
        "loops": [_loop_record(edge) for edge in result.loops],
        "reference": None if error is None else _error_record(error),
    }


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}


def _loop_record(edge: Edge) -> dict[str, Any]:
    assert edge.loop is not None
    return {
        "first": edge.first,
        "second": edge.second,
        "first_from_second": pose_record(edge.first_from_second),
        "deviation": np.sqrt(np.diag(edge.covariance)).tolist(),
        **dataclasses.asdict(edge.loop),
    }


def pose_record(pose: SE2) -> dict[str, float]:
    return {"x": pose.x, "y": pose.y, "yaw": pose.yaw}


def _error_record(error: AbsoluteError) -> dict[str, Any]:
    position, yaw = Spread.of(error.position), Spread.of(error.yaw)
    return {
        "reference_from_map": pose_record(error.reference_from_estimate),
        "position_rmse_m": position.rmse,
        "position_median_m": position.median,
        "position_max_m": position.max,
        "yaw_rmse_deg": math.degrees(yaw.rmse),
    }
