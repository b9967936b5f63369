"""What every method says of one place and seed."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from mapping.map_set import MapSet
from mapping.se2 import wrap_angle
from mapping.similarity2 import Similarity2
from mapquilt.benchmark.trial import one_thread, warm_up
from mapquilt.score import THESIS, transform_error
from mapquilt.thesis.cases import CASES, FLOOR_MAPS, Case, Place
from mapquilt.thesis.missions import DrawnMap
from merge.cells import CommonCells, compare_cells
from merge.merger import match_maps, merge_maps
from merge.result import PairResult
from merge.settings import MergeSettings


@dataclass(frozen=True)
class StudyAnswer:
    """Of one method, case and seed. ``right`` by the thesis's criterion; the errors as in
    :class:`mapquilt.score.TransformError`, None without an answer, or for a team; ``index`` is the acceptance index at
    the answer, ``true_index`` at the truth, both on the original rasters. ``transform`` is x, y, yaw and scale."""

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

    The floor's pairs are matched each by itself, and take a third of the time each; the team is merged from their
    answers.
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
    team = _team(maps, FLOOR_MAPS)
    start = time.process_time()
    pairs = {(pair.target, pair.source): pair for pair in match_maps(team, settings, seed)}
    matched = time.process_time() - start
    result = merge_maps(team, settings, seed, answers=pairs)
    seconds = time.process_time() - start
    found: list[Timed] = []
    for case in (case for case in CASES if case.place == "floor"):
        if case.team:
            right = _team_right(maps, dict(result.reference_from_map))
            accepted = not result.left_out
            found.append((StudyAnswer(case.name, seed, settings.title, right, accepted, None), seconds))
        else:
            answer = _scored(case, maps, settings, seed, pairs[case.maps[0], case.maps[1]])
            found.append((answer, matched / len(pairs)))
    return found


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


def _team_right(maps: Mapping[str, DrawnMap], reference_from_map: dict[str, Similarity2]) -> bool:
    """Whether every map lies right in every other's frame. Two wings may have no cell in common: displacements are
    those of all cells that the source knows."""
    if set(reference_from_map) != set(FLOOR_MAPS):
        return False
    for case in (case for case in CASES if case.place == "floor" and not case.team):
        target, source = (maps[name] for name in case.maps)
        place = reference_from_map[case.maps[0]].inverse() @ reference_from_map[case.maps[1]]
        truth = _truth(target, source)
        points = source.grid.frame.metres_from_cells(np.argwhere(source.grid.known))
        off = np.hypot(*(place.apply(points) - truth.apply(points)).T).mean() / target.grid.frame.resolution
        turned = math.degrees(wrap_angle(place.yaw - truth.yaw))
        scaled = 100.0 * (place.scale / truth.scale - 1.0)
        if not (
            off <= THESIS.displacement_cells
            and abs(turned) <= THESIS.rotation_deg
            and abs(scaled) <= THESIS.scale_percent
        ):
            return False
    return True
