"""Simulate teams of mapping robots, merge occupancy grids, and evaluate merges.

``import mapquilt as mq; result = mq.merge(["a.yaml", "b.yaml"])``. Names load what they need when they are first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mapping.geometry.scale_range import ScaleRange
    from mapping.geometry.se2 import SE2
    from mapping.geometry.similarity2 import Similarity2
    from mapping.grid.frame import GridFrame
    from mapping.grid.frame_perturbation import FramePerturbationRanges
    from mapping.grid.occupancy_grid import OccupancyGrid
    from mapping.io.map_file import load_map, save_map
    from mapping.map_set import MapSet
    from mapping.settings import MappingSettings
    from mapquilt.api import merge, simulate
    from mapquilt.dataset.loader import load_dataset
    from mapquilt.runs.sample import Sample, SampleSettings
    from merge.merger import merge_maps
    from merge.records.prior import Prior
    from merge.records.result import MergeResult, PairResult
    from merge.settings import MergeSettings
    from sim.mission.settings import MissionSettings
    from sim.sensors.settings import SensingSettings

_HOMES = {
    "FramePerturbationRanges": "mapping.grid.frame_perturbation",
    "GridFrame": "mapping.grid.frame",
    "MapSet": "mapping.map_set",
    "MappingSettings": "mapping.settings",
    "MergeResult": "merge.records.result",
    "MergeSettings": "merge.settings",
    "MissionSettings": "sim.mission.settings",
    "OccupancyGrid": "mapping.grid.occupancy_grid",
    "PairResult": "merge.records.result",
    "Prior": "merge.records.prior",
    "SE2": "mapping.geometry.se2",
    "Sample": "mapquilt.runs.sample",
    "SampleSettings": "mapquilt.runs.sample",
    "ScaleRange": "mapping.geometry.scale_range",
    "SensingSettings": "sim.sensors.settings",
    "Similarity2": "mapping.geometry.similarity2",
    "load_dataset": "mapquilt.dataset.loader",
    "load_map": "mapping.io.map_file",
    "merge": "mapquilt.api",
    "merge_maps": "merge.merger",
    "save_map": "mapping.io.map_file",
    "simulate": "mapquilt.api",
}

__all__ = [
    "SE2",
    "FramePerturbationRanges",
    "GridFrame",
    "MapSet",
    "MappingSettings",
    "MergeResult",
    "MergeSettings",
    "MissionSettings",
    "OccupancyGrid",
    "PairResult",
    "Prior",
    "Sample",
    "SampleSettings",
    "ScaleRange",
    "SensingSettings",
    "Similarity2",
    "load_dataset",
    "load_map",
    "merge",
    "merge_maps",
    "save_map",
    "simulate",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'mapquilt' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
