"""The office floor: the pairs of its three robots, and the three merged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations

from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet
from mapquilt.evaluation.transform_error import THESIS, transform_error
from merge.merger import merge_maps
from merge.pair.feature_cache import FeatureCache
from merge.records.result import PairResult
from reproductions.chen2021.answers import Answer, evaluated, results
from reproductions.chen2021.cases import FLOOR_CASES, FLOOR_MAPS, TEAM
from reproductions.chen2021.methods import GROUPS, METHODS
from reproductions.chen2021.missions import DrawnMap, MapPair

CHAIN = (("robot 1", "robot 3"), ("robot 2", "robot 3"))
"""Pairs with much overlap; the map that is in both connects the other two."""

Answers = Mapping[tuple[str, str], PairResult]
Places = Mapping[str, Similarity2]
"""Transform of each map of a team, by name, into the frame of one of them."""


def floor_pairs(maps: Mapping[str, DrawnMap]) -> dict[str, MapPair]:
    """Pair the maps of the floor, by case."""
    pairs = {}
    for case in FLOOR_CASES:
        first, second = (f"robot {word}" for word in case.name.split() if word.isdigit())
        pairs[case.name] = MapPair(maps[first], maps[second], names=(first, second))
    return pairs


def floor_answers(maps: Mapping[str, DrawnMap], seed: int) -> Iterator[Answer]:
    """Run methods on the pairs of the floor, and merge the three robots from the first run of each pair."""
    cache = FeatureCache()
    for method in GROUPS["floor"]:
        first_runs: dict[tuple[str, str], PairResult] = {}
        for case, pair in floor_pairs(maps).items():
            for run, result in enumerate(results(pair, method, seed, cache)):
                first_runs.setdefault(pair.names, result)
                yield evaluated(pair, case, method, seed, run, result)
        yield team_answer(maps, method, seed, *_merged(maps, method, seed, first_runs))


def _merged(maps: Mapping[str, DrawnMap], method: str, seed: int, pairs: Answers) -> tuple[Places, bool]:
    """Place the maps by the common acceptance, or chain them if the method runs as published."""
    settings = METHODS[method].settings
    if settings.as_published:
        return chained(pairs)
    team = MapSet(FLOOR_MAPS, tuple(maps[name].grid for name in FLOOR_MAPS), ("m", "m", "m"))
    merged = merge_maps(team, settings, seed, answers=pairs)
    return merged.reference_from_map, not merged.left_out


def chained(pairs: Answers) -> tuple[Places, bool]:
    """Place every map in the third robot's frame by the pairs of the chain; True if both pairs were accepted.

    A pipeline that knows pairs only cannot weigh one pair against another.
    """
    links = {names: pairs[names] for names in CHAIN}
    placed = {"robot 3": Similarity2.identity()}
    for (target, _), link in links.items():
        if link.target_from_source is not None:
            placed[target] = link.target_from_source.inverse()
    return placed, all(link.accepted for link in links.values())


def team_answer(
    maps: Mapping[str, DrawnMap], method: str, seed: int, reference_from_map: Places, accepted: bool
) -> Answer:
    """Evaluate a team by its worst pair: it is right if every map lies right in every other's frame.

    Errors are those of all cells that the second map knows, since two wings may have no cell in common.
    """
    if set(reference_from_map) != set(FLOOR_MAPS):
        return Answer(TEAM, method, seed, 0, False, accepted)
    errors = [
        transform_error(
            maps[first].grid,
            maps[second].grid,
            MapPair(maps[first], maps[second]).truth,
            reference_from_map[first].inverse() @ reference_from_map[second],
            cells="source",
        )
        for first, second in combinations(FLOOR_MAPS, 2)
    ]
    return Answer(
        TEAM,
        method,
        seed,
        run=0,
        right=all(THESIS.holds(error) for error in errors),
        accepted=accepted,
        rotation_deg=max(error.rotation_deg for error in errors),
        scale_percent=max(error.scale_percent for error in errors),
        displacement_cells=max(error.displacement_cells or 0.0 for error in errors),
    )
