"""Contradiction: drift is none, walls of another storey are, and swapping the maps changes nothing."""

from __future__ import annotations

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.alignment.contradiction import Contradiction, measure_contradiction
from merge.alignment.elastic import bend_onto
from merge.alignment.settings import AlignmentSettings, ContradictionSettings
from merge.preparation.prepared_map import PreparedMap
from merge.records.bend import Bend
from merge.verification.wall_overlap import measure_wall_overlap_by_tolerance

SHAPE = (300, 400)
TIGHTER = 2


def storey(pieces=(), bend: float = 0.0) -> PreparedMap:
    """A floor of 400 x 300 cells with four rooms and further walls: row, col, rows, cols of each.

    ``bend`` moves the walls sideways, more and more along the rows, by so many cells at most.
    """
    cells = np.zeros(SHAPE, np.int8)
    cells[:3] = cells[-3:] = 100
    cells[:, :20] = cells[:, -20:] = 100
    cells[148:151, :170] = cells[148:151, 230:] = cells[:120, 199:202] = cells[180:, 199:202] = 100
    for row, col, rows, cols in pieces:
        cells[row : row + rows, col : col + cols] = 100
    if bend:
        rows = np.arange(SHAPE[0])[:, None]
        shift = np.round(bend * (rows / SHAPE[0]) ** 2).astype(int)
        cells = cells[rows, np.clip(np.arange(SHAPE[1])[None] - shift, 0, SHAPE[1] - 1)]
    return PreparedMap(OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), SHAPE), cells))


def settings_of(level: int) -> AlignmentSettings:
    return AlignmentSettings(contradiction=ContradictionSettings(level=level))


def measured(target: PreparedMap, source: PreparedMap, level: int = TIGHTER) -> Contradiction:
    return measure_contradiction(
        target, source, Similarity2(), bend_onto(target, source, Similarity2()), settings_of(level)
    )


def test_a_map_does_not_contradict_itself():
    assert measured(storey(), storey()) == Contradiction(0.0, 0.0, 0.0)


def test_drift_is_no_contradiction():
    """The walls move by up to 12 cells, four times the tolerance; but bent, they fit."""
    straight, bent = storey(), storey(bend=12.0)
    rigid = measure_wall_overlap_by_tolerance(straight, bent, Similarity2())[TIGHTER]
    found = measured(straight, bent)
    assert rigid.violation_ratio > 0.1
    assert found.violation_ratio < 0.01
    assert found.conflict_ratio == 0.0


def test_a_wall_of_another_storey_is_a_conflict_of_its_length():
    """One map has a wall of 100 cells where the other has free space: both sides and both ends count."""
    found = measured(storey([(220, 60, 3, 100)]), storey())
    assert found.conflict_cells == pytest.approx((2 * 100 + 2) / 2.0, abs=6.0)  # mean of both directions
    compared = found.conflict_cells / found.conflict_ratio
    assert found.violation_ratio == pytest.approx(found.conflict_cells / compared, abs=1e-9)


def test_many_small_objects_that_one_robot_saw_are_a_violation_but_no_conflict():
    boxes = [(row, col, 4, 4) for row in range(30, 280, 40) for col in range(30, 390, 40) if col not in (190, 230)]
    found = measured(storey(boxes), storey(), level=4)
    assert found.violation_ratio > 0.08
    assert found.conflict_ratio == 0.0


@pytest.mark.parametrize("scale", [1.0, 0.5])
def test_without_a_bend_swapping_the_maps_changes_nothing(scale):
    target, source = storey([(220, 60, 3, 100)]), storey([(60, 300, 40, 3)], bend=5.0)
    answer, still = Similarity2(4.0, -3.0, 0.02, scale), Bend(np.zeros(2), 100.0, np.zeros((4, 5, 2)))
    there = measure_contradiction(target, source, answer, still, settings_of(TIGHTER))
    back = measure_contradiction(source, target, answer.inverse(), still, settings_of(TIGHTER))
    assert there.violation_ratio == pytest.approx(back.violation_ratio, rel=1e-6)
    assert there.conflict_cells == pytest.approx(back.conflict_cells, rel=1e-6)


def test_maps_without_common_ground_say_nothing():
    far, one = Similarity2(5000.0), storey()
    assert measure_contradiction(one, one, far, bend_onto(one, one, far)) == Contradiction(None, None, 0.0)
