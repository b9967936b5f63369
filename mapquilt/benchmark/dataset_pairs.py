"""The pairs of a data set, as the benchmark takes them."""

from __future__ import annotations

from pathlib import Path

from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.dataset.loader import DatasetPair, load_dataset

OTHER_WORLDS, NOTHING_COMMON = "other worlds", "nothing in common"
"""Subsets of pairs that must be refused."""


def dataset_pairs(folder: Path, split: str | None) -> list[BenchmarkPair]:
    """All pairs of a data set, or of one split. Raises ``ValueError`` naming the folder where it is none."""
    return [_pair(folder.resolve().name, pair) for pair in load_dataset(folder, split).pairs]


def _pair(suite: str, pair: DatasetPair) -> BenchmarkPair:
    subset, truth = None, pair.target_from_source
    if truth is None:
        subset = OTHER_WORLDS
    elif pair.overlap == 0.0:
        subset, truth = NOTHING_COMMON, None
    return BenchmarkPair(
        suite=suite,
        name=pair.name,
        target_path=pair.target_path,
        source_path=pair.source_path,
        truth=truth,
        subset=subset,
        world=pair.world,
        noise=pair.noise,
        overlap=pair.overlap,
        identifiable=pair.identifiable,
        fitted=pair.residual is not None,
        residual=pair.residual,
        target_scale=pair.target_scale,
        resolutions_trusted=pair.resolutions_trusted,
        mission=pair.mission,
    )
