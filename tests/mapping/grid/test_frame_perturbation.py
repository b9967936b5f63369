"""Frame perturbations: positions of cells, survival of walls, and their inverse by the recorded truth."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage
from scipy.spatial import cKDTree

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.frame_perturbation import FramePerturbationRanges, draw_frame_perturbations, perturb_frame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.truth import fit_rigid

similarities = st.builds(
    Similarity2, st.floats(-9, 9), st.floats(-9, 9), st.floats(-math.pi, math.pi), st.floats(0.5, 2.0)
)


def room(wall=1):
    """An L-shaped room with walls of so many cells, unknown outside, in an odd frame."""
    inside = np.zeros((60, 80), bool)
    inside[8:50, 8:30] = inside[8:24, 8:70] = True
    ring = ndimage.binary_dilation(inside, np.ones((3, 3)), iterations=wall) & ~inside
    log_odds = np.where(inside, -1.5, 0.0) + np.where(ring, 2.5, 0.0)
    return OccupancyGrid(GridFrame(0.05, SE2(-1.3, 0.7, 0.0), (60, 80)), log_odds.astype(np.float32))


def centres(grid, mask):
    return grid.frame.metres_from_cells(np.argwhere(mask))


@pytest.mark.slow
@given(similarities)
def test_the_truth_maps_walls_onto_walls_within_half_a_cell(start_from_map):
    grid = room()
    hidden = perturb_frame(grid, start_from_map)
    wall, moved = centres(grid, grid.occupied), start_from_map.apply(centres(hidden, hidden.occupied))
    half = 0.5 * 0.05 * (math.sqrt(2.0) * max(1.0, start_from_map.scale))
    # In both directions, as far as half a (true) cell's diagonal in the one raster and half a cell in the other.
    assert cKDTree(wall).query(moved)[0].max() <= half + 0.5 * 0.05 * math.sqrt(2.0) + 1e-9
    assert cKDTree(moved).query(wall)[0].max() <= half + 1e-9


@pytest.mark.slow
@given(similarities)
def test_the_truth_has_no_systematic_shift(start_from_map):
    grid = room()
    hidden = perturb_frame(grid, start_from_map)
    moved = start_from_map.apply(centres(hidden, hidden.known))
    # Each known cell against the known cell nearest to it: a shift of half a cell would show as half a cell.
    nearest = centres(grid, grid.known)[cKDTree(centres(grid, grid.known)).query(moved)[1]]
    fit = fit_rigid(moved, nearest)
    cell = 0.05 * max(1.0, start_from_map.scale)
    assert abs(fit.yaw) < 0.01
    assert np.abs((nearest - moved).mean(axis=0)).max() < 0.3 * cell


@given(similarities)
def test_unknown_stays_unknown_and_free_stays_free(start_from_map):
    grid = room(wall=2)
    hidden = perturb_frame(grid, start_from_map)
    cells = grid.frame.cells_from_metres(start_from_map.apply(centres(hidden, hidden.free)))
    assert grid.frame.contains(cells).all()
    deep_unknown = ndimage.binary_erosion(~grid.known, np.ones((3, 3)), iterations=2)
    assert not deep_unknown[cells[:, 0], cells[:, 1]].any()
    area = hidden.known.sum() * start_from_map.scale**2
    assert area == pytest.approx(grid.known.sum(), rel=0.12)


@given(similarities)
def test_walls_stay_closed(start_from_map):
    hidden = perturb_frame(room(wall=2), start_from_map)
    free, parts = ndimage.label(hidden.free, np.ones((3, 3)))
    outside = np.pad(~hidden.known, 1, constant_values=True)
    leaks = ndimage.binary_dilation(outside)[1:-1, 1:-1] & hidden.free
    assert parts == 1
    assert leaks.sum() <= 0.01 * hidden.free.sum()
    assert free.max() == 1


@pytest.mark.parametrize("turns", [0, 1, 2, 3])
def test_quarter_turns_only_rotate_the_array(turns):
    grid = room()
    hidden = perturb_frame(grid, Similarity2(yaw=-turns * math.pi / 2))
    expected = np.rot90(grid.log_odds[7:51, 7:71], k=-turns)
    assert hidden.log_odds == pytest.approx(expected, abs=1e-6)


def test_a_factor_of_two_by_hand():
    grid = OccupancyGrid(GridFrame(0.05, SE2(), (4, 4)), np.full((4, 4), -1.0, np.float32))
    coarse = perturb_frame(grid, Similarity2(scale=2.0))
    assert coarse.frame.shape == (2, 2)
    assert coarse.frame.resolution == 0.05
    fine = perturb_frame(grid, Similarity2(scale=0.5))
    assert fine.frame.shape == (8, 8)


def test_a_wall_of_one_cell_survives_cells_of_four_times_its_width():
    log_odds = np.full((41, 41), -1.0, np.float32)
    log_odds[20, :] = 3.0
    coarse = perturb_frame(OccupancyGrid(GridFrame(0.05, SE2(), (41, 41)), log_odds), Similarity2(yaw=0.3, scale=4.0))
    assert ndimage.label(coarse.occupied, np.ones((3, 3)))[1] == 1
    assert coarse.occupied.sum() >= 10


def test_draws_stay_in_their_ranges_and_pairs_within_the_width():
    ranges = FramePerturbationRanges(max_yaw=1.0, max_offset=3.0)
    teams = [draw_frame_perturbations(seed, 4, ranges) for seed in range(200)]
    scales = np.array([[one.scale for one in team] for team in teams])
    assert 0.5 <= scales.min() < 0.6
    assert 1.7 < scales.max() <= 2.0
    assert (scales.max(axis=1) / scales.min(axis=1)).max() <= 2.0
    assert abs(np.log(scales).mean()) < 0.1
    back = [one.inverse() for team in teams for one in team]
    assert 0.9 < max(abs(one.yaw) for one in back) <= 1.0
    assert 2.7 < max(abs(one.x) for one in back) <= 3.0


def test_each_map_of_a_team_has_its_own_perturbation():
    team = draw_frame_perturbations(3, 4, FramePerturbationRanges())
    for name in ("x", "y", "yaw", "scale"):
        assert len({getattr(one, name) for one in team}) == 4


def test_perturbations_of_true_scale_keep_the_other_draws():
    ranges = FramePerturbationRanges(scale_low=1.0, scale_high=1.0), FramePerturbationRanges()
    for honest, hidden in zip(*(draw_frame_perturbations(3, 3, each) for each in ranges), strict=True):
        assert honest.scale == 1.0
        assert honest.yaw == hidden.yaw
        assert honest.inverse().x == pytest.approx(hidden.inverse().x)


def test_another_robot_changes_no_other_perturbation():
    assert draw_frame_perturbations(3, 5, FramePerturbationRanges())[:2] == draw_frame_perturbations(
        3, 2, FramePerturbationRanges()
    )


@pytest.mark.parametrize(
    "setting",
    [{"scale_low": 0.0}, {"scale_low": 3.0}, {"max_yaw": 4.0}, {"max_offset": -1.0}, {"max_offset": math.inf}],
)
def test_bad_ranges_are_refused(setting):
    with pytest.raises(ValueError, match="FramePerturbationRanges"):
        FramePerturbationRanges(**setting)


def test_a_blank_grid_is_refused():
    with pytest.raises(ValueError, match="no known cell"):
        perturb_frame(OccupancyGrid(GridFrame(0.05, SE2(), (3, 3)), np.zeros((3, 3), np.float32)), Similarity2())


def test_a_map_too_large_to_be_read_is_refused() -> None:
    grid = OccupancyGrid(GridFrame(0.05, SE2(), (2000, 2000)), np.ones((2000, 2000), np.float32))
    with pytest.raises(ValueError, match="20000 x 20000 cells"):
        perturb_frame(grid, Similarity2(0.0, 0.0, 0.0, 0.1))
