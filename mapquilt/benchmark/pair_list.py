"""Lists of pairs of map files in JSON, read and written."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Any

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.pixel_matrix import pixel_matrix
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.evaluation.evaluated_pair import GroundTruth, PairInfo
from mapquilt.json_file import read_record

PAIRS_FILE = "pairs.json"

FARTHEST = 1e5
"""Largest translation of a true transform [pixels]: several times the side of the largest picture that is read."""

LARGEST_SCALE = 100.0
"""Largest scale of a true transform, and the inverse of the smallest."""

NEGATIVE = "negative"


def read_pair_list(path: Path) -> list[BenchmarkPair]:
    """Read the pairs of a file, in order. Paths of maps are relative to it.

    The truth of a pair maps pixels of ``map_b`` to pixels of ``map_a``, centres at integers, y down: ``a = scale
    R(rotation_deg) b + (tx, ty)``. It is taken as exact where the list states no residual.

    Raises ``ValueError`` or ``OSError`` naming the file and the pair.
    """
    files: dict[str, Path] = {}
    pairs = [_listed_pair(path, entry, files) for entry in read_record(path, "pairs")["pairs"]]
    names = [pair.info.name for pair in pairs]
    repeated = sorted(name for name, count in Counter(names).items() if count > 1)
    if repeated:
        raise ValueError(f"{path}: more than one pair is called {repeated[0]!r}, names must differ")
    missing = {file for file in files.values() if not file.is_file()}
    for pair in pairs if missing else ():
        for file in (pair.target_file, pair.source_file):
            if file in missing:
                raise ValueError(f"{path}: pair {pair.info.name}: {file}: no such file")
    return pairs


def _listed_pair(path: Path, entry: dict[str, Any], known: dict[str, Path]) -> BenchmarkPair:
    """Build a pair; ``known`` holds the path of each map once for all pairs."""
    files = [known.setdefault(entry[name], path.parent / entry[name]) for name in ("map_a", "map_b")]
    return BenchmarkPair(
        info=PairInfo(
            name=entry["name"],
            target=files[0].stem,
            source=files[1].stem,
            suite=path.parent.name or path.stem,
            subset=entry.get("subset") or None,
            target_file=files[0],
            source_file=files[1],
            world=entry.get("world"),
            mission=entry.get("mission"),
            geometry=entry.get("geometry"),
            noise=entry.get("noise"),
            poses=entry.get("poses"),
        ),
        target_file=files[0],
        source_file=files[1],
        truth=GroundTruth(
            None if entry["kind"] == NEGATIVE else _pixel_transform(path, entry),
            overlap=entry.get("overlap"),
            identifiable=entry.get("identifiable", True),
            residual_m=entry.get("residual_m", 0.0),
            target_scale=entry.get("target_scale", 1.0),
        ),
        in_pixels=True,
        resolutions_trusted=entry.get("resolutions_trusted", True),
    )


def pair_entry(
    info: PairInfo,
    truth: GroundTruth,
    *,
    frames: tuple[GridFrame, GridFrame],
    resolutions_trusted: bool,
    files: tuple[str, str] = ("", ""),
) -> dict[str, Any]:
    """Build the entry of a pair, so that reading the list gives the same pair.

    ``truth`` is in metres as the two maps, target and source with ``frames``, state them; ``files`` are their map
    files, relative to the list.
    """
    transform, place = truth.target_from_source, {}
    if transform is not None:
        target, source = frames
        pixels = Similarity2.from_matrix(pixel_matrix(target, transform, source))
        turn = math.degrees(pixels.yaw)
        place = {"scale": pixels.scale, "rotation_deg": turn, "tx": pixels.x, "ty": pixels.y}
    return {
        "name": info.name,
        "kind": NEGATIVE if transform is None else "positive",
        "subset": info.subset,
        "map_a": files[0],
        "map_b": files[1],
        **place,
        "overlap": truth.overlap,
        "identifiable": truth.identifiable,
        "residual_m": truth.residual_m,
        "target_scale": truth.target_scale,
        "resolutions_trusted": resolutions_trusted,
        "world": info.world,
        "mission": info.mission,
        "geometry": info.geometry,
        "noise": info.noise,
        "poses": info.poses,
    }


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
