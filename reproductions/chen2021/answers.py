"""What every method says of one place and seed."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any

import numpy as np

from mapping.geometry.se2 import wrap_angle
from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet
from mapquilt.benchmark.trial import one_thread, warm_up
from mapquilt.evaluation.transform_error import THESIS, transform_error
from merge.merger import match_maps, merge_maps
from merge.records.result import PairResult
from merge.settings import MergeSettings
from merge.verification.cell_overlap import CommonCells, compare_cells
from reproductions.chen2021.cases import CASES, FLOOR_MAPS, Case, Place
from reproductions.chen2021.missions import DrawnMap


@dataclass(frozen=True)
class StudyAnswer:
    """Of one method, case and seed. ``right`` by the thesis's criterion; the errors as in
    ``TransformError``, None without an answer, and for a team the greatest of any two of its maps;
    ``index`` is the acceptance index at the answer, ``true_index`` at the truth, both on the original rasters, and
    ``transform`` x, y, yaw and scale; a team has none of these."""

    case: str
    seed: int
    method: str
    right: bool
    accepted: bool
    confidence: float | None
    rotation_deg: float | None = None
    scale_percent: float | None = None
    displacement_cells: float | None = None
    index: float | None = None
    true_index: float | None = None
    transform: tuple[float, float, float, float] | None = None

    def record(self) -> dict[str, Any]:
        return asdict(self)

    @staticmethod
    def from_record(record: dict[str, Any]) -> StudyAnswer:
        transform = record["transform"]
        return StudyAnswer(**(record | {"transform": None if transform is None else tuple(transform)}))


Timed = tuple[StudyAnswer, float]
"""An answer and the processor seconds that it took, on one thread."""


def answers_of(place: Place, maps: Mapping[str, DrawnMap], settings: MergeSettings, seed: int) -> list[Timed]:
    """A method on each case of the place.

    The floor's pairs are matched each by itself, and take a third of the time each. The three robots are merged from
    these answers: as a team by the common judge, chained through the third robot's map by a pipeline as published.
    """
    with one_thread():
        warm_up(settings)
        return _of_hall(maps, settings, seed) if place == "hall" else _of_floor(maps, settings, seed)


def _of_hall(maps: Mapping[str, DrawnMap], settings: MergeSettings, seed: int) -> list[Timed]:
    found = []
    for case in (case for case in CASES if case.place == "hall"):
        start = time.process_time()
        (pair,) = match_maps(_team(maps, case.maps), settings, seed)
        found.append((_scored(case, maps, settings, seed, pair), time.process_time() - start))
    return found


def _of_floor(maps: Mapping[str, DrawnMap], settings: MergeSettings, seed: int) -> list[Timed]:
    start = time.process_time()
    pairs = {(pair.target, pair.source): pair for pair in match_maps(_team(maps, FLOOR_MAPS), settings, seed)}
    each = (time.process_time() - start) / len(pairs)
    found: list[Timed] = []
    for case in (case for case in CASES if case.place == "floor"):
        if not case.team:
            found.append((_scored(case, maps, settings, seed, pairs[case.maps[0], case.maps[1]]), each))
        elif settings.as_published:
            placed, accepted = chained(pairs)
            found.append((_scored_team(case, maps, settings, seed, placed, accepted), each * len(CHAIN)))
        else:
            start = time.process_time()
            merged = merge_maps(_team(maps, case.maps), settings, seed, answers=pairs)
            placed, accepted = dict(merged.reference_from_map), not merged.left_out
            seconds = time.process_time() - start + each * len(pairs)
            found.append((_scored_team(case, maps, settings, seed, placed, accepted), seconds))
    return found


CHAIN = (("robot 1", "robot 3"), ("robot 2", "robot 3"))
"""Pairs that have much in common; the map that is in both holds the other two together."""


def chained(pairs: Mapping[tuple[str, str], PairResult]) -> tuple[dict[str, Similarity2], bool]:
    """Every map's place in the third robot's frame by the pairs of the chain alone, and whether both were believed.

    Nothing weighs one pair against another: a pipeline that only knows pairs can do no more.
    """
    links = {names: pairs[names] for names in CHAIN}
    placed = {"robot 3": Similarity2.identity()}
    for (target, _), link in links.items():
        if link.target_from_source is not None:
            placed[target] = link.target_from_source.inverse()
    return placed, all(link.accepted for link in links.values())


def _team(maps: Mapping[str, DrawnMap], names: tuple[str, ...]) -> MapSet:
    return MapSet(names, tuple(maps[name].grid for name in names), tuple("m" for _ in names))


def _scored(
    case: Case, maps: Mapping[str, DrawnMap], settings: MergeSettings, seed: int, pair: PairResult
) -> StudyAnswer:
    target, source = (maps[name] for name in case.maps)
    truth = _truth(target, source)
    true_index = compared_cells(target, source).acceptance_index
    place = pair.target_from_source
    if place is None:
        return StudyAnswer(
            case.name, seed, settings.title, False, pair.accepted, pair.confidence, true_index=true_index
        )
    error = transform_error(target.grid, source.grid, truth, place)
    return StudyAnswer(
        case.name,
        seed,
        settings.title,
        THESIS.holds(error),
        pair.accepted,
        pair.confidence,
        error.rotation_deg,
        error.scale_percent,
        error.displacement_cells,
        compared_cells(target, source, place).acceptance_index,
        true_index,
        (place.x, place.y, place.yaw, place.scale),
    )


def compared_cells(target: DrawnMap, source: DrawnMap, target_from_source: Similarity2 | None = None) -> CommonCells:
    """Two maps compared cell by cell, at the truth or at an answer in metres."""
    place = _truth(target, source) if target_from_source is None else target_from_source
    corners = [Similarity2.from_se2(each.grid.frame.origin, each.grid.frame.resolution) for each in (target, source)]
    return compare_cells(target.grid, source.grid, corners[0].inverse() @ place @ corners[1])


def _truth(target: DrawnMap, source: DrawnMap) -> Similarity2:
    return Similarity2.from_se2(target.world_from_map.inverse() @ source.world_from_map)


def _scored_team(
    case: Case,
    maps: Mapping[str, DrawnMap],
    settings: MergeSettings,
    seed: int,
    reference_from_map: Mapping[str, Similarity2],
    accepted: bool,
) -> StudyAnswer:
    """Right where every map lies right in every other's frame."""
    if set(reference_from_map) != set(case.maps):
        return StudyAnswer(case.name, seed, settings.title, False, accepted, None)
    errors = [
        _error_of_all_cells(
            maps[target], maps[source], reference_from_map[target].inverse() @ reference_from_map[source]
        )
        for target, source in combinations(case.maps, 2)
    ]
    rotation, scale, cells = (max(error[k] for error in errors) for k in range(3))
    right = rotation <= THESIS.rotation_deg and scale <= THESIS.scale_percent and cells <= THESIS.displacement_cells
    return StudyAnswer(case.name, seed, settings.title, right, accepted, None, rotation, scale, cells)


def _error_of_all_cells(target: DrawnMap, source: DrawnMap, place: Similarity2) -> tuple[float, float, float]:
    """Rotation [degrees], scale [percent] and mean displacement of all cells that the source knows [cells of the
    target]: two wings may have no cell in common."""
    truth = _truth(target, source)
    points = source.grid.frame.metres_from_cells(np.argwhere(source.grid.known))
    moved = np.hypot(*(place.apply(points) - truth.apply(points)).T).mean()
    turned = abs(math.degrees(wrap_angle(place.yaw - truth.yaw)))
    return turned, 100.0 * abs(place.scale / truth.scale - 1.0), float(moved) / target.grid.frame.resolution
