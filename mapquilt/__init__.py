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
    from mapquilt.api import compare_methods, evaluate, merge, simulate
    from mapquilt.benchmark.results import BenchmarkResults
    from mapquilt.dataset.loader import load_dataset
    from mapquilt.evaluation.evaluated_pair import EvaluatedPair
    from mapquilt.runs.sample import Sample
    from mapquilt.settings import ExperimentConfig, SampleSettings
    from merge.merger import merge_maps
    from merge.methods import register as register_method
    from merge.preparation.prepared_map import PreparedMap
    from merge.records.prior import Prior
    from merge.records.proposal import Proposal
    from merge.records.result import MergeResult, PairResult
    from merge.settings import MergeSettings
    from sim.mission.settings import MissionSettings
    from sim.sensors.settings import SensingSettings

_HOMES = {
    "BenchmarkResults": "mapquilt.benchmark.results",
    "EvaluatedPair": "mapquilt.evaluation.evaluated_pair",
    "ExperimentConfig": "mapquilt.settings",
    "FramePerturbationRanges": "mapping.grid.frame_perturbation",
    "GridFrame": "mapping.grid.frame",
    "MapSet": "mapping.map_set",
    "MappingSettings": "mapping.settings",
    "MergeResult": "merge.records.result",
    "MergeSettings": "merge.settings",
    "MissionSettings": "sim.mission.settings",
    "OccupancyGrid": "mapping.grid.occupancy_grid",
    "PairResult": "merge.records.result",
    "PreparedMap": "merge.preparation.prepared_map",
    "Prior": "merge.records.prior",
    "Proposal": "merge.records.proposal",
    "SE2": "mapping.geometry.se2",
    "Sample": "mapquilt.runs.sample",
    "SampleSettings": "mapquilt.settings",
    "ScaleRange": "mapping.geometry.scale_range",
    "SensingSettings": "sim.sensors.settings",
    "Similarity2": "mapping.geometry.similarity2",
    "compare_methods": "mapquilt.api",
    "evaluate": "mapquilt.api",
    "load_dataset": "mapquilt.dataset.loader",
    "load_map": "mapping.io.map_file",
    "merge": "mapquilt.api",
    "merge_maps": "merge.merger",
    "register_method": "merge.methods:register",
    "save_map": "mapping.io.map_file",
    "simulate": "mapquilt.api",
}

__all__ = [
    "SE2",
    "BenchmarkResults",
    "EvaluatedPair",
    "ExperimentConfig",
    "FramePerturbationRanges",
    "GridFrame",
    "MapSet",
    "MappingSettings",
    "MergeResult",
    "MergeSettings",
    "MissionSettings",
    "OccupancyGrid",
    "PairResult",
    "PreparedMap",
    "Prior",
    "Proposal",
    "Sample",
    "SampleSettings",
    "ScaleRange",
    "SensingSettings",
    "Similarity2",
    "compare_methods",
    "evaluate",
    "load_dataset",
    "load_map",
    "merge",
    "merge_maps",
    "register_method",
    "save_map",
    "simulate",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'mapquilt' has no attribute {name!r}")
    module, _, attribute = _HOMES[name].partition(":")
    return getattr(import_module(module), attribute or name)


def __dir__() -> list[str]:
    return sorted(__all__)
