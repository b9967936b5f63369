import math

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import resampled
from merge.fusion import FusionSettings, finest, fuse, fuse_and_compare

FRAME = GridFrame(0.1, SE2(3.0, -2.0, 0.4), (2, 3))
GRID = OccupancyGrid.from_occupancy(FRAME, [[100, 0, -1], [0, -1, 100]])
SELF = Similarity2.identity()


def test_a_map_fused_with_itself_keeps_shape_and_sign():
    fused = fuse(FRAME, [(SELF, GRID), (SELF, GRID)])
    assert fused.frame == FRAME
    np.testing.assert_array_equal(fused.log_odds, 2 * GRID.log_odds)


@pytest.mark.parametrize("fusion", ["log_odds", "least_entropy", "max"])
@pytest.mark.parametrize("rows", [1, 16, 37])
def test_the_bands_of_rows_change_nothing(fusion, rows):
    """A map of random walls, and the same a few cells off, so that walls are lost, kept and doubled across bands."""
    rng = np.random.default_rng(3)
    cells = np.where(rng.random((90, 80)) < 0.06, 100, np.where(rng.random((90, 80)) < 0.1, -1, 0))
    grid = OccupancyGrid.from_occupancy(GridFrame(0.1, SE2(), cells.shape), cells)
    maps = [(SELF, grid), (Similarity2(0.25, -0.1, 0.02), grid), (Similarity2(-0.3, 0.2, 0.5), grid)]
    whole = fuse_and_compare(grid.frame, maps, fusion, FusionSettings(band_rows=1000))
    banded = fuse_and_compare(grid.frame, maps, fusion, FusionSettings(band_rows=rows))
    np.testing.assert_array_equal(banded.merged.log_odds, whole.merged.log_odds)
    np.testing.assert_array_equal(banded.conflicts.log_odds, whole.conflicts.log_odds)
    assert banded.doubled_walls == whole.doubled_walls > 0.0


def test_two_adjacent_cells_by_hand():
    one = OccupancyGrid.from_occupancy(GridFrame(0.5, SE2(10.0, 20.0), (1, 1)), [[100]])
    shifted = Similarity2(-0.5, -1.0)  # one column to the left, two rows down
    fused = fuse(one.frame, [(SELF, one), (shifted, one)])
    assert fused.frame.shape == (3, 2)
    assert fused.frame.origin == SE2(9.5, 19.0)
    assert fused.occupancy().tolist() == [[100, -1], [-1, -1], [-1, 100]]


def test_a_map_to_the_upper_right_keeps_the_origin():
    fused = fuse(
        FRAME, [(SELF, GRID), (Similarity2.from_se2(FRAME.origin @ SE2(0.2, 0.1) @ FRAME.origin.inverse()), GRID)]
    )
    assert fused.frame.origin == FRAME.origin
    assert fused.frame.shape == (3, 5)
    assert fused.occupancy().tolist() == [[100, 0, -1, -1, -1], [0, -1, 100, 0, -1], [-1, -1, 0, -1, 100]]


def test_every_cell_of_the_reference_keeps_its_position():
    turned = Similarity2(0.7, -0.9, 1.1, 1.3)
    fused = fuse(FRAME, [(SELF, GRID), (turned, GRID)])
    assert fused.frame.origin.yaw == FRAME.origin.yaw
    centres = FRAME.metres_from_cells(np.indices(FRAME.shape).reshape(2, -1).T)
    local = fused.frame.origin.inverse().apply(centres) / fused.frame.resolution
    np.testing.assert_allclose(local % 1.0, 0.5, atol=1e-9)
    corners = turned.apply(FRAME.metres_from_cells([(-0.5, -0.5), (1.5, -0.5), (-0.5, 2.5), (1.5, 2.5)]))
    inside = fused.frame.contains(fused.frame.cells_from_metres(corners))
    assert inside.all()


def test_cells_twice_as_large_cover_four():
    coarse = OccupancyGrid.from_occupancy(GridFrame(0.1, SE2(), (1, 1)), [[100]])
    reference = OccupancyGrid.from_occupancy(GridFrame(0.1, SE2(), (1, 1)), [[0]])
    fused = fuse(reference.frame, [(Similarity2(scale=2.0), coarse)])
    assert fused.occupancy().tolist() == [[100, 100], [100, 100]]


def test_evidence_that_cancels_stays_known():
    opposite = OccupancyGrid(FRAME, -GRID.log_odds)
    fused = fuse(FRAME, [(SELF, GRID), (SELF, opposite)])
    np.testing.assert_array_equal(fused.known, GRID.known)


def test_log_odds_add_by_value():
    weak = OccupancyGrid(FRAME, np.full((2, 3), -0.5, dtype=np.float32))
    fused = fuse(FRAME, [(SELF, GRID), (SELF, weak)])
    assert fused.log_odds[0, 0] == pytest.approx(math.log(9.0) - 0.5)
    assert fused.log_odds[0, 2] == pytest.approx(-0.5)


def test_a_thin_wall_of_a_finer_map_stays_whole():
    """A slanted wall of 0.02 m cells in a map of 0.1 m cells: every cell that it crosses is occupied."""
    fine = np.zeros((200, 200), int)
    fine[np.arange(200), (np.arange(200) * 0.37 + 40).astype(int)] = 100
    grid = OccupancyGrid.from_occupancy(GridFrame(0.02, SE2(), (200, 200)), fine)
    reference = OccupancyGrid.from_occupancy(GridFrame(0.1, SE2(), (40, 40)), np.full((40, 40), -1))
    fused = fuse(reference.frame, [(SELF, reference), (SELF, grid)])
    cells = fused.frame.cells_from_metres(grid.frame.metres_from_cells(np.argwhere(grid.occupied)))
    assert fused.occupied[cells[:, 0], cells[:, 1]].all()
    assert fused.occupied.sum() < 2.5 * 40


def cells(values, frame=FRAME):
    return OccupancyGrid(frame, np.array(values, np.float32))


A = cells([[2.0, -1.0, 0.0], [-0.5, 1.0, 3.0]])
B = cells([[-1.0, -2.0, -1.0], [0.5, 0.0, -3.0]])


@pytest.mark.parametrize(
    ("fusion", "expected"),
    [
        ("log_odds", [[1.0, -3.0, -1.0], [-1e-6, 1.0, -1e-6]]),
        ("least_entropy", [[2.0, -2.0, -1.0], [0.5, 1.0, 3.0]]),
        ("max", [[2.0, -1.0, -1.0], [0.5, 1.0, 3.0]]),
    ],
)
def test_each_rule_by_hand_in_either_order(fusion, expected):
    for grids in ([(SELF, A), (SELF, B)], [(SELF, B), (SELF, A)]):
        np.testing.assert_allclose(fuse(FRAME, grids, fusion).log_odds, expected, atol=1e-7)


def test_least_entropy_takes_the_most_certain_of_all_and_their_mean():
    """Chen 2021, appendix A: per cell, the one of p1, p2 and their mean with the least Shannon entropy."""
    rng = np.random.default_rng(0)
    frame = GridFrame(0.1, SE2(), (20, 20))
    one, two = (cells(rng.uniform(-3, 3, (20, 20)), frame) for _ in range(2))

    def entropy(p):
        return -(p * np.log(p) + (1 - p) * np.log(1 - p))

    p = [1 / (1 + np.exp(-grid.log_odds.astype(float))) for grid in (one, two)]
    options = np.array([*p, (p[0] + p[1]) / 2])
    chosen = np.take_along_axis(options, entropy(options).argmin(axis=0)[None], axis=0)[0]
    fused = fuse(frame, [(SELF, one), (SELF, two)], "least_entropy")
    np.testing.assert_allclose(1 / (1 + np.exp(-fused.log_odds.astype(float))), chosen, atol=1e-6)


def test_a_wall_deep_in_free_space_is_a_conflict_unlike_one_a_cell_off():
    frame = GridFrame(0.1, SE2(), (9, 9))
    one, two = np.zeros((9, 9)), np.zeros((9, 9))
    one[:, 0] = one[4, 4] = 100
    two[:, 1] = 100
    grids = [(SELF, OccupancyGrid.from_occupancy(frame, values)) for values in (one, two)]
    conflicts = fuse_and_compare(frame, grids).conflicts
    assert np.argwhere(conflicts.occupied).tolist() == [[4, 4]]
    assert conflicts.free.sum() == 80


def test_cells_are_as_fine_as_the_finest_in_the_metres_of_the_reference():
    finer = finest(FRAME, [0.1, 0.04])
    assert (finer.resolution, finer.origin, finer.shape) == (0.04, FRAME.origin, (5, 8))
    assert finest(FRAME, [0.1, 0.2]) == FRAME


def test_local_lookup_equals_lookup_over_the_whole_raster():
    """By a slow sum over the whole merged raster."""
    rng = np.random.default_rng(4)
    grids = []
    for place in (SELF, Similarity2(3.1, -2.3, 0.8, 0.7), Similarity2(-4.0, 1.2, -2.0, 1.4)):
        frame = GridFrame(0.1, SE2(*rng.uniform(-2, 2, 2), rng.uniform(-3, 3)), (17, 23))
        grids.append(
            (place, OccupancyGrid.from_occupancy(frame, rng.choice([-1, 0, 100], (17, 23), p=[0.2, 0.6, 0.2])))
        )
    fused = fuse_and_compare(grids[0][1].frame, grids)
    seen = [resampled(grid, place, fused.merged.frame, FusionSettings().samples) for place, grid in grids]
    total = np.sum(seen, axis=0, dtype=np.float32)
    np.testing.assert_allclose(np.where(total == 0.0, 0.0, fused.merged.log_odds), total, atol=1e-5)
    np.testing.assert_array_equal(fused.merged.known, np.any([part != 0.0 for part in seen], axis=0))
    twice = np.sum([part != 0.0 for part in seen], axis=0) > 1
    assert (fused.conflicts.free <= twice).all()


def lines(*columns, free=(0, 30)):
    """Draw vertical walls of one cell in 20 x 30 free cells."""
    values = np.full((20, 30), -1)
    values[:, slice(*free)] = 0
    values[:, list(columns)] = 100
    return OccupancyGrid.from_occupancy(GridFrame(0.05, SE2(), (20, 30)), values)


@pytest.mark.parametrize(
    ("maps", "columns"),
    [
        ((lines(10), lines(15)), [10, 15]),  # each erases the other's: both stay
        ((lines(10), lines(11)), [10, 11]),
        ((lines(10), lines(17)), []),  # too far apart to be one wall
        ((lines(10), lines(10), lines(13)), [10]),  # two maps outvote the third
        ((lines(10), lines(13), lines(14), lines(14, free=(12, 30))), [14]),
        ((lines(10), lines()), []),  # shown by one map only
        ((lines(10), lines(11), lines(12)), [10, 11, 12]),  # every column has two against one
    ],
)
def test_a_wall_that_maps_show_apart_is_kept_where_the_evidence_is_best(maps, columns):
    fused = fuse(maps[0].frame, [(SELF, grid) for grid in maps])
    assert sorted(set(np.argwhere(fused.occupied)[:, 1].tolist())) == columns
    if columns:
        assert fused.occupied[:, columns].all()
    backwards = fuse(maps[0].frame, [(SELF, grid) for grid in maps[::-1]])
    np.testing.assert_array_equal(backwards.log_odds, fused.log_odds)


def test_no_cell_of_the_sum_loses_its_wall_and_all_shared_walls_stay():
    """By slow search: every wall cell of a map that another shows within reach has a wall of the merged map as near."""
    rng = np.random.default_rng(3)
    frame = GridFrame(0.05, SE2(), (40, 40))
    reach = FusionSettings().same_wall_cells
    for _ in range(10):
        one, two = (OccupancyGrid.from_occupancy(frame, rng.choice([0, 100], (40, 40), p=[0.97, 0.03])) for _ in "ab")
        merged = fuse(frame, [(SELF, one), (SELF, two)]).occupied
        assert merged[one.occupied & two.occupied].all()
        walls = np.argwhere(merged)
        for mine, others in ((one, two), (two, one)):
            for cell in np.argwhere(mine.occupied):
                away = np.hypot(*(np.argwhere(others.occupied) - cell).T).min()
                if away <= reach:
                    assert np.hypot(*(walls - cell).T).min() <= away + 1e-2


def test_doubled_walls_are_the_share_of_common_walls_drawn_twice():
    """Of 60 cells, 40 are drawn by one map alone, four of them at the rim, where no free space lies around them."""
    frame = lines(5).frame
    assert fuse_and_compare(frame, [(SELF, lines(2, 10)), (SELF, lines(2, 15))]).doubled_walls == pytest.approx(36 / 60)
    assert fuse_and_compare(frame, [(SELF, lines(5)), (SELF, lines(5))]).doubled_walls == 0.0
    assert fuse_and_compare(frame, [(SELF, lines(5)), (SELF, lines(25))]).doubled_walls == 0.0
