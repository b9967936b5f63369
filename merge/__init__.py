"""Merging of occupancy grids: grids in; transforms, verdicts and one grid out."""

from mapping.geometry.scale_range import ScaleRange
from merge.merger import Progress, merge_maps
from merge.records.evidence import Evidence
from merge.records.result import MergeResult, PairResult
from merge.settings import MergeSettings

__all__ = ["Evidence", "MergeResult", "MergeSettings", "PairResult", "Progress", "ScaleRange", "merge_maps"]
