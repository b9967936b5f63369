"""Sources of pairs: lists of pairs in JSON files, data sets, and even samples of either."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mapping.geometry.similarity2 import Similarity2
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.dataset.loader import DatasetPair, load_dataset
from mapquilt.evaluation.evaluated_pair import GroundTruth, PairInfo
from mapquilt.json_file import read_record

FARTHEST = 1e5
"""Largest translation of a true transform [pixels]: several times the side of the largest picture that is read."""

LARGEST_SCALE = 100.0
"""Largest scale of a true transform, and the inverse of the smallest."""

NEGATIVE = "negative"
OTHER_WORLDS, NOTHING_COMMON = "other worlds", "nothing in common"
"""Subsets of pairs that must be refused."""


def read_pair_list(path: Path) -> list[BenchmarkPair]:
    """Read the pairs of a file, in order. Paths of maps are relative to it.

    The truth of a pair maps pixels of ``map_b`` to pixels of ``map_a``, centres at integers, y down: ``a = scale
    R(rotation_deg) b + (tx, ty)``. It is taken as exact. Raises ``ValueError`` or ``OSError`` naming the file and the
    pair.
    """
    pairs = [_listed_pair(path, entry) for entry in read_record(path, "pairs")["pairs"]]
    names = [pair.info.name for pair in pairs]
    repeated = sorted(name for name, count in Counter(names).items() if count > 1)
    if repeated:
        raise ValueError(f"{path}: more than one pair is called {repeated[0]!r}, names must differ")
    for pair in pairs:
        for file in (pair.target_file, pair.source_file):
            if not file.is_file():
                raise ValueError(f"{path}: pair {pair.info.name}: {file}: no such file")
    return pairs


def _listed_pair(path: Path, entry: dict[str, Any]) -> BenchmarkPair:
    files = [path.parent / entry[name] for name in ("map_a", "map_b")]
    return BenchmarkPair(
        info=_info(path.parent.name or path.stem, entry["name"], files, subset=entry.get("subset") or None),
        target_file=files[0],
        source_file=files[1],
        truth=GroundTruth(
            None if entry["kind"] == NEGATIVE else _pixel_transform(path, entry),
            overlap=entry.get("overlap"),
            residual_m=0.0,
        ),
        in_pixels=True,
    )


def _info(suite: str, name: str, files: Sequence[Path], **fields: Any) -> PairInfo:
    return PairInfo(
        name=name,
        target=files[0].stem,
        source=files[1].stem,
        suite=suite,
        target_file=files[0],
        source_file=files[1],
        **fields,
    )


def _pixel_transform(path: Path, entry: dict[str, Any]) -> Similarity2:
    try:
        numbers = [float(entry[name]) for name in ("tx", "ty", "rotation_deg", "scale")]
        if not max(abs(numbers[0]), abs(numbers[1])) <= FARTHEST:
            raise ValueError(f"tx, ty are {numbers[0]:g}, {numbers[1]:g} pixels, must lie within {FARTHEST:g}")
        if not 1.0 / LARGEST_SCALE <= numbers[3] <= LARGEST_SCALE:
            raise ValueError(f"scale is {numbers[3]:g}, must lie between {1.0 / LARGEST_SCALE:g} and {LARGEST_SCALE:g}")
        return Similarity2(numbers[0], numbers[1], math.radians(numbers[2]), numbers[3])
    except (KeyError, TypeError):
        raise ValueError(
            f"{path}: pair {entry['name']}: scale, rotation_deg, tx or ty is missing; give all four, or kind {NEGATIVE}"
        ) from None
    except ValueError as error:
        raise ValueError(f"{path}: pair {entry['name']}: {error}") from None


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
        info=_info(
            suite,
            pair.name,
            files,
            subset=subset,
            world=pair.world,
            noise=pair.noise,
            poses=pair.poses,
            mission=pair.mission,
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
