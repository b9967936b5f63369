"""Grids in; transforms, verdicts and one grid out. Knows no simulator and no truth."""

from merge.merger import Progress, merge_maps
from merge.result import Evidence, MergeResult, PairResult
from merge.scale_range import ScaleRange
from merge.settings import MergeSettings

__all__ = ["Evidence", "MergeResult", "MergeSettings", "PairResult", "Progress", "ScaleRange", "merge_maps"]
