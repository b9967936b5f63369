"""The team of three robots, on small maps with a truth set by hand."""

import math

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.records.result import PairResult
from reproductions.chen2021.cases import FLOOR_CASES, FLOOR_MAPS, TEAM
from reproductions.chen2021.missions import DrawnMap
from reproductions.chen2021.pictures import _around
from reproductions.chen2021.team import chained, floor_pairs, team_answer

STARTS = {"robot 1": SE2(3.0, 4.0, 0.5), "robot 2": SE2(40.0, 2.0, -2.0), "robot 3": SE2(20.0, -9.0, 1.2)}


@pytest.fixture(scope="module")
def maps():
    rng = np.random.default_rng(0)
    grids = {name: rng.normal(size=(60, 80)).astype(np.float32) for name in FLOOR_MAPS}
    frame = GridFrame(0.05, SE2(-1.0, -2.0, 0.0), (60, 80))
    return {name: DrawnMap(OccupancyGrid(frame, cells), STARTS[name]) for name, cells in grids.items()}


def truth(target, source):
    return Similarity2.from_se2(STARTS[target].inverse() @ STARTS[source])


def pair(target, source, place, accepted=True):
    return PairResult(target, source, accepted, 0.9, None if accepted else "unsure", place, None, "m", None)


def all_pairs(**other):
    """Every pair by the truth, but for those that are given, as in ``one_three=place``."""
    numbers = {"one": "robot 1", "two": "robot 2", "three": "robot 3"}
    pairs = {(a, b): pair(a, b, truth(a, b)) for a, b in (FLOOR_MAPS[:2], FLOOR_MAPS[::2], FLOOR_MAPS[1:])}
    for words, place in other.items():
        names = tuple(numbers[word] for word in words.split("_"))
        pairs[names] = pair(*names, place)
    return pairs


def scored(maps, placed, accepted=True):
    return team_answer(maps, "SIFT", 0, placed, accepted)


def test_the_pairs_of_the_floor_are_those_that_the_cases_name(maps):
    pairs = floor_pairs(maps)
    assert list(pairs) == [case.name for case in FLOOR_CASES]
    assert pairs["office 2 and 3"].names == ("robot 2", "robot 3")
    assert pairs["office 2 and 3"].first is maps["robot 2"]
    assert pairs["office 2 and 3"].truth.matrix() == pytest.approx(truth("robot 2", "robot 3").matrix())


def test_two_right_pairs_place_all_three_robots(maps):
    placed, accepted = chained(all_pairs(one_two=Similarity2(100.0, -7.0, 3.0, 0.4)))
    assert accepted
    found = scored(maps, placed)
    assert (found.trial, found.right) == (TEAM, True)
    errors = [found.rotation_deg, found.scale_percent, found.displacement_cells]
    assert errors == pytest.approx([0, 0, 0], abs=1e-6)


@pytest.mark.parametrize("pair_name", ["one_three", "two_three"])
def test_one_wrong_pair_makes_the_team_wrong(maps, pair_name):
    placed, _ = chained(all_pairs(**{pair_name: Similarity2(1.0, 2.0, 0.1)}))
    assert not scored(maps, placed).right


def test_without_an_answer_for_a_pair_the_team_is_incomplete(maps):
    pairs = all_pairs()
    pairs["robot 2", "robot 3"] = pair("robot 2", "robot 3", None, accepted=False)
    placed, accepted = chained(pairs)
    assert set(placed) == {"robot 1", "robot 3"}
    assert not accepted
    found = scored(maps, placed, accepted)
    assert (found.right, found.displacement_cells) == (False, None)


@pytest.mark.parametrize(("off", "right"), [(0.45, True), (0.55, False)])
def test_the_error_of_a_team_is_the_greatest_of_any_two(maps, off, right):
    """10 cells are half a metre."""
    placed = {name: truth("robot 3", name) for name in FLOOR_MAPS}
    placed["robot 1"] = Similarity2(0.0, off) @ placed["robot 1"]
    found = scored(maps, placed)
    assert found.right == right
    assert found.displacement_cells == pytest.approx(off / 0.05)


def test_rotations_and_scales_of_a_team_count(maps):
    placed = {name: truth("robot 3", name) for name in FLOOR_MAPS}
    about = placed["robot 2"].apply(np.array([1.0, -0.5]))  # the middle of its cells
    turned = Similarity2(*about, math.radians(6.0), 1.0) @ Similarity2(*about).inverse()
    found = scored(maps, placed | {"robot 2": turned @ placed["robot 2"]})
    assert (found.rotation_deg, found.right) == (pytest.approx(6.0), False)
    grown = Similarity2(*about, 0.0, 1.06) @ Similarity2(*about).inverse()
    found = scored(maps, placed | {"robot 2": grown @ placed["robot 2"]})
    assert (found.scale_percent, found.right) == (pytest.approx(6.0), False)


@pytest.mark.parametrize("place", [None, Similarity2(3.0, -2.0, 0.7), Similarity2(1.0, 1.0, -2.0, 0.5)])
def test_the_picture_of_a_merge_holds_both_maps_whole(maps, place):
    target, source = maps["robot 1"].grid, maps["robot 2"].grid
    frame = _around(target, source, place)
    points = [target.frame.metres_from_cells(np.argwhere(target.known))]
    if place is not None:
        points.append(place.apply(source.frame.metres_from_cells(np.argwhere(source.known))))
    assert frame.contains(frame.cells_from_metres(np.concatenate(points))).all()


def test_the_picture_of_a_merge_gone_wrong_stays_small(maps):
    target, source = maps["robot 1"].grid, maps["robot 2"].grid
    frame = _around(target, source, Similarity2(9_000.0, 9_000.0, 0.0, 40.0))
    assert max(frame.shape) < 5 * max(target.frame.shape)
