"""Pairs of data sets, and even samples of pairs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.dataset.loader import DatasetPair, load_dataset
from mapquilt.evaluation.evaluated_pair import GroundTruth, PairInfo

OTHER_WORLDS, NOTHING_COMMON = "other worlds", "nothing in common"
"""Subsets of pairs that must be refused."""


def dataset_pairs(folder: Path, split: str | None) -> list[BenchmarkPair]:
    """Read all pairs of a data set, or of one split. Raises ``ValueError`` naming a folder that is no data set."""
    return [_dataset_pair(folder.resolve().name, pair) for pair in load_dataset(folder, split).pairs]


def _dataset_pair(suite: str, pair: DatasetPair) -> BenchmarkPair:
    subset, transform = None, pair.target_from_source
    if transform is None:
        subset = OTHER_WORLDS
    elif pair.overlap == 0.0:
        subset, transform = NOTHING_COMMON, None
    files = [pair.target_path, pair.source_path]
    return BenchmarkPair(
        info=PairInfo(
            name=pair.name,
            target=files[0].stem,
            source=files[1].stem,
            suite=suite,
            target_file=files[0],
            source_file=files[1],
            subset=subset,
            world=pair.world,
            noise=pair.noise,
            poses=pair.poses,
            mission=pair.mission,
            geometry=pair.geometry,
        ),
        target_file=files[0],
        source_file=files[1],
        truth=GroundTruth(
            transform,
            overlap=pair.overlap,
            identifiable=pair.identifiable,
            residual_m=pair.residual,
            target_scale=pair.target_scale,
        ),
        resolutions_trusted=pair.resolutions_trusted,
        digests=pair.digests,
    )


def even_sample(pairs: Sequence[BenchmarkPair], number: int, rng: np.random.Generator) -> list[BenchmarkPair]:
    """Draw about equal shares of every stratum, in the order of ``pairs``; all if there are no more than ``number``.

    Systematic sampling (Madow and Madow 1944): pairs sorted by stratum are taken at equal steps from a random start.
    Raises ``ValueError`` if ``number`` is not positive.
    """
    if number < 1:
        raise ValueError(f"--limit {number}: must be at least 1")
    if number >= len(pairs):
        return list(pairs)
    by_stratum = sorted(range(len(pairs)), key=lambda index: (_stratum(pairs[index]), index))
    steps = (np.arange(number) + rng.random()) * (len(pairs) / number)
    return [pairs[index] for index in sorted(by_stratum[math.floor(step)] for step in steps.tolist())]


def _stratum(pair: BenchmarkPair) -> tuple[str, bool, str, str, bool, float]:
    info, truth = pair.info, pair.truth
    return (
        info.suite,
        truth.target_from_source is None,
        info.subset or "",
        info.world or "",
        truth.identifiable,
        truth.overlap or 0.0,
    )
