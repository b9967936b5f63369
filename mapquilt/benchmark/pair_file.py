"""Pairs of map files with their true pixel transforms, listed in a JSON file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from mapping.geometry.similarity2 import Similarity2
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.json_file import read_record

NEGATIVE = "negative"


def read_pairs(path: Path) -> list[BenchmarkPair]:
    """The pairs of a file, in order. Paths of maps are relative to it.

    The truth of a pair maps pixels of ``map_b`` to pixels of ``map_a``, centres at integers, y down: ``a = scale
    R(rotation_deg) b + (tx, ty)``. Raises ``ValueError`` or ``OSError`` naming the file and what is wrong.
    """
    pairs = [_pair(path, entry) for entry in read_record(path, "pairs")["pairs"]]
    names = [pair.name for pair in pairs]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise ValueError(f"{path}: more than one pair is called {repeated[0]!r}")
    for pair in pairs:
        for file in (pair.target_path, pair.source_path):
            if not file.is_file():
                raise ValueError(f"{path}: pair {pair.name}: {file}: no such file")
    return pairs


def _pair(path: Path, entry: dict[str, Any]) -> BenchmarkPair:
    negative = entry["kind"] == NEGATIVE
    return BenchmarkPair(
        suite=path.parent.name or path.stem,
        name=entry["name"],
        target_path=path.parent / entry["map_a"],
        source_path=path.parent / entry["map_b"],
        truth=None if negative else _truth(path, entry),
        in_pixels=True,
        subset=entry.get("subset") or None,
        overlap=entry.get("overlap"),
    )


def _truth(path: Path, entry: dict[str, Any]) -> Similarity2:
    try:
        numbers = [float(entry[name]) for name in ("tx", "ty", "rotation_deg", "scale")]
        return Similarity2(numbers[0], numbers[1], math.radians(numbers[2]), numbers[3])
    except (KeyError, TypeError):
        raise ValueError(
            f"{path}: pair {entry['name']}: needs scale, rotation_deg, tx and ty, for it is not {NEGATIVE}"
        ) from None
    except ValueError as error:
        raise ValueError(f"{path}: pair {entry['name']}: {error}") from None
