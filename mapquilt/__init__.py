"""The workbench: command line, runs, scores and pictures. The names below are what most scripts need.

They are loaded when first used, so that the command line is there before what it may need.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mapping.geometry.scale_range import ScaleRange
    from mapping.io.map_file import load_map, save_map
    from mapping.map_set import MapSet
    from mapquilt.dataset.loader import load_dataset
    from merge.merger import merge_maps
    from merge.settings import MergeSettings

__all__ = ["MapSet", "MergeSettings", "ScaleRange", "load_dataset", "load_map", "merge_maps", "save_map"]

_HOMES = {
    "MapSet": "mapping.map_set",
    "MergeSettings": "merge.settings",
    "ScaleRange": "mapping.geometry.scale_range",
    "load_dataset": "mapquilt.dataset.loader",
    "load_map": "mapping.io.map_file",
    "merge_maps": "merge.merger",
    "save_map": "mapping.io.map_file",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'mapquilt' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
