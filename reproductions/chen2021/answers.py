"""Answers of every method to the cases of one place and seed."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, GroundTruth, PairInfo, evaluate_pair
from mapquilt.evaluation.pair_rows import ERRORS, from_row, to_row
from mapquilt.evaluation.transform_error import THESIS, TransformError, transform_error
from mapquilt.jobs.timing import one_thread, warm_up
from merge.merger import match_maps, merge_maps
from merge.records.result import PairResult
from merge.settings import MergeSettings
from merge.verification.cell_overlap import CommonCells, compare_cells
from reproductions.chen2021.cases import CASES, FLOOR_MAPS, Case, Place
from reproductions.chen2021.missions import DrawnMap


@dataclass(frozen=True)
class CaseAnswer:
    """One method's answer to a case and seed, evaluated by the thesis's criterion.

    ``index`` is the acceptance index at the answer, ``true_index`` at the truth, both on the original rasters. For a
    team, the errors are the greatest of any two of its maps, and there is no index and no transform.
    """

    case: str
    seed: int
    pair: EvaluatedPair
    index: float | None = None
    true_index: float | None = None

    def record(self) -> dict[str, Any]:
        row = to_row(self.pair)
        return {"case": self.case, "seed": self.seed, "index": self.index, "true_index": self.true_index, "pair": row}

    @staticmethod
    def from_record(record: dict[str, Any]) -> CaseAnswer:
        return CaseAnswer(**record | {"pair": from_row(record["pair"])})


Timed = tuple[CaseAnswer, float]
"""An answer and its processor time on one thread."""


def answers_of(place: Place, maps: Mapping[str, DrawnMap], settings: MergeSettings, seed: int) -> list[Timed]:
    """Run a method on each case of the place.

    The floor's pairs are matched one by one, and each takes a third of the time. The three robots are merged from these
    answers: as a team by the common acceptance, chained through the third robot's map by a pipeline as published.
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
"""Pairs with much overlap; the map that is in both connects the other two."""


def chained(pairs: Mapping[tuple[str, str], PairResult]) -> tuple[dict[str, Similarity2], bool]:
    """Place every map in the third robot's frame by the pairs of the chain; True if both pairs were accepted.

    A pipeline that knows pairs only cannot weigh one pair against another.
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
) -> CaseAnswer:
    target, source = (maps[name] for name in case.maps)
    place = pair.target_from_source
    return CaseAnswer(
        case.name,
        seed,
        evaluate_pair(
            target.grid,
            source.grid,
            GroundTruth(_truth(target, source), residual_m=0.0),
            pair,
            pair=_info(case, seed),
            method=settings.title,
            criterion=THESIS,
        ),
        None if place is None else compared_cells(target, source, place).acceptance_index,
        compared_cells(target, source).acceptance_index,
    )


def _info(case: Case, seed: int) -> PairInfo:
    return PairInfo(case.name, case.maps[0], " and ".join(case.maps[1:]), mission=str(seed))


def compared_cells(target: DrawnMap, source: DrawnMap, target_from_source: Similarity2 | None = None) -> CommonCells:
    """Compare two maps cell by cell, at the truth or at an answer in metres."""
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
) -> CaseAnswer:
    """Evaluate a team by its worst pair: it is right if every map lies right in every other's frame.

    Errors are those of all cells that the source knows, since two wings may have no cell in common.
    """
    error = None
    if set(reference_from_map) == set(case.maps):
        errors = [
            transform_error(
                maps[target].grid,
                maps[source].grid,
                _truth(maps[target], maps[source]),
                reference_from_map[target].inverse() @ reference_from_map[source],
                cells="source",
            )
            for target, source in combinations(case.maps, 2)
        ]
        error = TransformError(*(max(getattr(one, name) for one in errors) for name in ERRORS))
    found = EvaluatedPair(
        pair=_info(case, seed),
        truth=GroundTruth(Similarity2.identity(), residual_m=0.0),
        method=settings.title,
        accepted=accepted,
        error=error,
        right=error is not None and THESIS.holds(error),
        distorted=False,
    )
    return CaseAnswer(case.name, seed, found)
