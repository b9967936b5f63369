"""Cropping keeps the known cells in place; the diagonal of their bounding box."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid

FRAME = GridFrame(0.1, SE2(3.0, -2.0, 0.4), (7, 9))


def places(grid, mask):
    return grid.frame.metres_from_cells(np.argwhere(mask))


@given(arrays(np.int8, FRAME.shape, elements=st.sampled_from([-1, -1, -1, 0, 100])), st.integers(0, 3))
def test_cropping_keeps_all_known_cells_and_exactly_the_margin(occupancy, margin):
    grid = OccupancyGrid.from_occupancy(FRAME, occupancy)
    cropped = grid.cropped(margin)
    for mask in ("occupied", "free"):
        np.testing.assert_allclose(
            places(cropped, getattr(cropped, mask)), places(grid, getattr(grid, mask)), atol=1e-12
        )
    known = np.argwhere(cropped.known)
    if len(known):
        assert (known.min(axis=0) == margin).all()
        assert (known.max(axis=0) == np.array(cropped.frame.shape) - 1 - margin).all()


def test_a_grid_without_known_cells_keeps_one_cell_and_its_margin():
    blank = OccupancyGrid(FRAME, np.zeros(FRAME.shape, np.float32))
    assert blank.cropped(2).frame.shape == (5, 5)


@pytest.mark.parametrize("corner", [(0, 0), (2, 3), (-4, 1)])
def test_a_window_keeps_the_coordinates_of_cells(corner):
    window = FRAME.window(corner, (3, 4))
    cells = np.array([[0, 0], [2, 3]])
    np.testing.assert_allclose(
        window.metres_from_cells(cells), FRAME.metres_from_cells(cells + np.array(corner)), atol=1e-12
    )


def test_known_diagonal_is_that_of_the_bounding_box():
    log_odds = np.zeros((50, 50), np.float32)
    assert OccupancyGrid(GridFrame(0.1, SE2(), (50, 50)), log_odds).known_diagonal == 0.0
    log_odds[10:13, 20:24] = -1.0
    assert OccupancyGrid(GridFrame(0.1, SE2(), (50, 50)), log_odds).known_diagonal == pytest.approx(0.5)
