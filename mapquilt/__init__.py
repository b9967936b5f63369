"""The workbench: command line, runs, scores and pictures. The names below are what most scripts need."""

from mapping.map_file import load_map, save_map
from mapping.map_set import MapSet
from mapquilt.dataset.loader import load_dataset
from merge.merger import merge_maps
from merge.scale_range import ScaleRange
from merge.settings import MergeSettings

__all__ = ["MapSet", "MergeSettings", "ScaleRange", "load_dataset", "load_map", "merge_maps", "save_map"]
