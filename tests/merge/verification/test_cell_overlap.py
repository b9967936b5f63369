import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.preparation.surface import centres
from merge.verification.cell_overlap import compare_cells


def grid(rows):
    values = np.array(rows)[::-1]  # written as seen, highest row first
    return OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), values.shape), values)


A = grid([[100, 100, -1], [0, 0, 100], [0, -1, 0]])
B = grid([[100, 0, 0], [0, 100, 100], [-1, -1, 0]])


def test_three_by_three_by_hand():
    # both know: top 100/100, 100/0; middle 0/0, 0/100, 100/100; bottom 0/0: four of six agree
    common = compare_cells(A, B, Similarity2.identity())
    assert (common.agree, common.disagree) == (4.0, 2.0)
    assert common.acceptance_index == pytest.approx(2 / 3)
    assert common.overlap == pytest.approx(6 / 7)  # A and B know seven cells each


def test_shifted_by_one_column_by_hand():
    # B one to the right: A's columns 1, 2 on B's 0, 1: 100/100; 0/0, 100/100; and A's -1 meets nothing; bottom 0 on -1
    common = compare_cells(A, B, Similarity2(1.0, 0.0))
    assert (common.agree, common.disagree) == (3.0, 0.0)


def test_a_cell_is_looked_up_at_its_centre():
    assert compare_cells(A, B, Similarity2(0.6, 0.0)) == compare_cells(A, B, Similarity2(1.0, 0.0))
    assert compare_cells(A, B, Similarity2(0.4, -0.4)) == compare_cells(A, B, Similarity2.identity())


def test_a_map_of_half_the_cell_size_agrees_with_itself_everywhere():
    fine = OccupancyGrid(GridFrame(1.0, SE2(), (6, 6)), np.kron(A.log_odds, np.ones((2, 2), dtype=np.float32)))
    common = compare_cells(A, fine, Similarity2(scale=0.5))
    assert common.acceptance_index == 1.0
    assert common.known == pytest.approx(7.0)  # counted in cells of the coarser map, whichever that is
    assert compare_cells(fine, A, Similarity2(scale=2.0)).known == pytest.approx(7.0)


def test_swapping_the_maps_changes_nothing():
    rng = np.random.default_rng(0)
    maps = [
        OccupancyGrid(GridFrame(1.0, SE2(), (30, 40)), rng.integers(-1, 2, (30, 40)).astype(np.float32)) for _ in "ab"
    ]
    there = Similarity2(7.3, -4.1, 0.7, 1.4)
    one, other = compare_cells(*maps, there), compare_cells(*maps[::-1], there.inverse())
    assert (one.agree, one.disagree, one.smaller) == pytest.approx((other.agree, other.disagree, other.smaller))


def test_disjoint_maps_have_no_index():
    common = compare_cells(A, B, Similarity2(50.0, 0.0))
    assert common.acceptance_index is None
    assert common.overlap == 0.0


def test_centres_are_offset_by_half_a_cell():
    mask = np.zeros((3, 5), dtype=bool)
    mask[2, 0] = mask[1, 4] = True
    assert centres(mask).tolist() == [[4.5, 1.5], [0.5, 2.5]]
