"""The maps of the trials: their overlap, their truth, and the measures that describe them."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.footprint import observed
from mapquilt.evaluation.statistics import Share
from merge.records.result import PairResult
from reproductions.chen2021 import missions
from reproductions.chen2021.answers import Answer, acceptance_index, acceptance_index_of_greys, evaluated
from reproductions.chen2021.cases import HALL_CASES, LEVELS, SETS, Condition, Overlap, trials
from reproductions.chen2021.descriptors import Descriptors
from reproductions.chen2021.missions import Areas, DrawnMap, Hall, MapPair, hole_share
from reproductions.chen2021.tally import tallies, wilson
from worlds.raster import true_raster

WHOLE = Condition(None)


@pytest.fixture(scope="module")
def hall():
    """The hall, with missions of some seconds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(missions, "HALL_DURATION", 16.0)
        patch.setattr(missions, "PATROL_DURATION", 10.0)
        return Hall(0)


def test_no_two_trials_are_alike_and_cases_overlap_as_in_the_thesis():
    found = trials()
    assert len({trial.name for trial in found}) == len(
        {trial.condition for trial in found if "full" not in trial.name}
    ) + len(HALL_CASES)
    assert len({trial.name for trial in found}) == len(found)
    assert {trial.name: trial.condition.overlap for trial in found}["set 1"] == Overlap(0.70, 0.44, holes=0.19)


def test_a_factor_changes_one_property():
    conditions = {trial.name: trial.condition for trial in trials()}
    for level in LEVELS[2::2]:
        base = conditions[f"overlap {level:g}, not cleared"]
        for name, condition in conditions.items():
            if name.endswith(f", overlap {level:g}"):
                changed = [
                    field.name for field in fields(base) if getattr(base, field.name) != getattr(condition, field.name)
                ]
                assert len(changed) == 1, name


def test_areas_are_those_of_the_footprints(hall):
    """An independent oracle: the footprints of both missions up to an end, and their common cells."""
    first, second = hall._paths[0][0], hall._paths[4][1]
    frame = true_raster(hall.world).frame
    for clear_range in (0.0, 4.9):
        areas = Areas.of(first, second, clear_range)
        for ends in ((0, 0), (2, 1), (len(first.ends) - 1, len(second.ends) - 1)):
            seen = [
                observed(path.truth.part(0, path.ends[end]), frame, clear_range)
                for path, end in zip((first, second), ends, strict=True)
            ]
            assert areas.common[ends] == np.count_nonzero(seen[0] & seen[1])
            assert (areas.first[ends[0], 0], areas.second[0, ends[1]]) == tuple(map(np.count_nonzero, seen))


@pytest.mark.slow
def test_maps_overlap_as_those_of_the_thesis():
    hall = Hall(2)
    for case in HALL_CASES:
        of_second, of_first = hall.pair(case.condition).overlap
        assert of_second == pytest.approx(case.overlap.of_second, abs=0.06), case.name
        assert of_first == pytest.approx(case.overlap.of_first, abs=0.06), case.name


def test_holes_are_what_known_cells_enclose():
    known = np.zeros((6, 8), dtype=bool)
    known[1:5, 1:6] = True
    assert hole_share(known) == 0.0
    known[2:4, 3] = False
    assert hole_share(known) == pytest.approx(2 / 20)
    known[4, 3] = False  # now it is a bay, open to the outside
    assert hole_share(known) == 0.0
    assert hole_share(np.zeros((3, 3), dtype=bool)) == 0.0


def test_holes_at_the_end_of_a_path_are_those_of_its_footprint(hall):
    path = hall._paths[4][1]
    frame = true_raster(hall.world).frame
    for end in (0, len(path.ends) - 1):
        seen = observed(path.truth.part(0, path.ends[end]), frame, 0.0)
        assert path.holes(0.0)[end] == pytest.approx(hole_share(seen))


def test_set_1_differs_by_245_degrees_and_the_others_by_188(hall):
    for case, degrees in zip(SETS, (245.4, 188.1, 188.1), strict=True):
        turn = hall.pair(replace(case.condition, overlap=None)).truth.inverse()
        assert math.degrees(turn.yaw) % 360.0 == pytest.approx(degrees, abs=0.1)


def test_maps_are_as_their_condition_says(hall):
    usual = hall.pair(WHOLE)
    coarse, noisy = (hall.pair(replace(WHOLE, **each)) for each in ({"resolution": 0.2}, {"range_sigma": 0.1}))
    cleared = hall.pair(replace(WHOLE, clear_range=4.9))
    assert coarse.second.grid.frame.resolution == 0.2
    for pair in (coarse, noisy):
        assert np.array_equal(pair.first.grid.log_odds, usual.first.grid.log_odds)
    assert np.count_nonzero(noisy.second.grid.occupied) > np.count_nonzero(usual.second.grid.occupied)
    assert np.count_nonzero(cleared.first.grid.known) > np.count_nonzero(usual.first.grid.known)


@pytest.mark.parametrize("mapper", ["log-odds", "counts", "particles"])
def test_maps_agree_at_the_truth_and_not_a_metre_away(hall, mapper):
    pair = hall.pair(replace(WHOLE, mapper=mapper))
    off = Similarity2.from_se2(SE2(1.0, 1.0)) @ pair.truth
    for index in (acceptance_index, acceptance_index_of_greys):
        assert index(pair, pair.truth) > 0.96
        assert index(pair, off) < index(pair, pair.truth) - 0.02


def grid_of(text, resolution=1.0):
    """A grid of a drawing, first line highest: # occupied, . free, blank unknown."""
    values = {"#": 100, ".": 0, " ": -1}
    lines = text.strip("\n").split("\n")
    width = max(len(line) for line in lines)
    cells = np.array([[values[cell] for cell in line.ljust(width)] for line in lines[::-1]])
    return OccupancyGrid.from_occupancy(GridFrame(resolution, SE2(), cells.shape), cells)


def test_descriptors_by_hand():
    first = grid_of("#####\n#...#\n#. .#\n#...#\n#####")
    second = grid_of("....#\n.....\n#....\n##...\n....#")
    found = Descriptors.of(MapPair(DrawnMap(first, SE2()), DrawnMap(second, SE2(2.0, 0.0))), "trial", 0)
    assert (found.of_second, found.of_first) == (14 / 25, 14 / 24)
    assert found.holes == (1 / 25, 0.0)
    assert found.pieces == (1, 3)
    assert found.thickness == (16 / 12, 5 / 5)
    assert found.known == (24 / 280, 25 / 280)


def test_the_index_of_greys_leaves_out_the_borders_of_walls():
    """Half a cell off, a wall of one cell is mixed with its sides, and no longer compared."""
    drawing = "\n".join(["." * 20] * 9 + ["#" * 20] + ["." * 20] * 9)
    pair = MapPair(DrawnMap(grid_of(drawing), SE2()), DrawnMap(grid_of(drawing), SE2()))
    assert acceptance_index_of_greys(pair, Similarity2()) == 1.0
    off = Similarity2(0.0, 0.4)
    assert acceptance_index_of_greys(pair, off) > acceptance_index(pair, Similarity2(0.0, 0.6))


@pytest.mark.parametrize(("off", "right"), [(9.9, True), (10.1, False)])
def test_an_answer_within_ten_cells_is_right(off, right):
    drawing = "\n".join(["." * 30] * 30)
    pair = MapPair(DrawnMap(grid_of(drawing), SE2()), DrawnMap(grid_of(drawing), SE2(5.0, 3.0, 0.2)))
    place = Similarity2(off, 0.0) @ pair.truth
    result = PairResult("first", "second", True, 0.9, None, place, None, "m", None)
    found = evaluated(pair, "trial", "SIFT", 3, 1, result)
    assert (found.right, found.seed, found.run, found.place) == (right, 3, 1, place)
    assert found.displacement_cells == pytest.approx(off)


@given(st.integers(1, 40).flatmap(lambda of: st.tuples(st.integers(0, of), st.just(of))))
def test_the_interval_of_a_count_is_wilsons(counted):
    count, of = counted
    expected = Share.counted([True] * count + [False] * (of - count)).interval
    found = wilson(count / of, of)
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high), abs=1e-9)


def test_runs_on_the_same_maps_are_counted_as_maps():
    answers = [
        Answer(
            "trial", "SIFT", seed, run, right=seed == 0, accepted=True, index=0.9 + 0.01 * run, displacement_cells=run
        )
        for seed in range(4)
        for run in range(5)
    ]
    found = tallies(answers)["trial", "SIFT"]
    assert (found.right, found.runs, found.maps, found.false_accepts) == (5, 20, 4, 15)
    assert (found.index, found.index_of_greys, found.error_cells) == (pytest.approx(0.92), None, 2)
    assert found.interval == wilson(0.25, 4)
