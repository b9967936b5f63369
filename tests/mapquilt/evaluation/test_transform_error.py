"""The score: the truth scores zero, its inverse does not, and errors worked out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapquilt.evaluation.transform_error import RIGHT, THESIS, normalised_error, transform_error
from merge.records.pair_answer import RIGHT_GROWTH, RIGHT_YAW


def full_grid(rows=40, cols=60, resolution=0.05, origin=(0.0, 0.0)):
    frame = GridFrame(resolution, SE2(*origin), (rows, cols))
    return OccupancyGrid(frame, np.full((rows, cols), -1.0, np.float32))


TRUTHS = [
    Similarity2(0.4, -0.3, 0.8, 1.0),
    Similarity2(1.5, 0.2, -0.2, 0.7),
    Similarity2(2.0, 1.9, math.pi - 0.2, 1.4),
]


@pytest.mark.parametrize("truth", TRUTHS)
def test_the_truth_scores_zero_and_its_inverse_does_not(truth):
    target, source = full_grid(), full_grid(30, 50)
    exact = transform_error(target, source, truth, truth)
    assert (exact.rotation_deg, exact.scale_percent, exact.displacement_m) == (0.0, 0.0, 0.0)
    assert RIGHT.holds(exact)
    backwards = transform_error(target, source, truth, truth.inverse())
    assert backwards.displacement_m > 0.3
    assert not RIGHT.holds(backwards)
    assert not THESIS.holds(backwards)


def test_a_shift_by_hand_in_all_three_units():
    target, source = full_grid(), full_grid()
    error = transform_error(target, source, Similarity2(), Similarity2(0.03, 0.04), target_scale=2.0)
    assert error.displacement_m == pytest.approx(0.10)
    assert error.displacement_cells == pytest.approx(1.0)
    assert error.displacement_of_diagonal == pytest.approx(0.05 / (0.05 * math.hypot(40, 60)))


def test_half_the_scale_is_fifty_percent_not_a_hundred():
    error = transform_error(full_grid(), full_grid(), Similarity2(scale=2.0), Similarity2(scale=1.0))
    assert error.scale_percent == pytest.approx(50.0)


def test_the_rotation_error_takes_the_shorter_way():
    error = transform_error(full_grid(), full_grid(), Similarity2(yaw=math.pi - 0.01), Similarity2(yaw=-math.pi + 0.01))
    assert error.rotation_deg == pytest.approx(math.degrees(0.02))


def test_displacement_is_that_of_common_cells_not_of_origins():
    """A rotation about the centre of the common cells moves a far origin by metres, but the cells little."""
    source = full_grid(10, 10, 0.05, origin=(100.0, 100.0))
    target = full_grid(10, 10, 0.05, origin=(100.0, 100.0))
    centre = Similarity2(100.25, 100.25)
    turned = centre @ Similarity2(yaw=0.02) @ centre.inverse()
    assert math.hypot(turned.x, turned.y) > 2.0
    assert transform_error(target, source, Similarity2(), turned).displacement_m < 0.005


def test_only_common_cells_count_relative_to_the_known_diagonal():
    """A growth about the origin moves each cell by a tenth of its distance; the target knows a box of 3 x 4 cells."""
    known = np.zeros((50, 50), np.float32)
    known[6:9, 8:12] = -1.0
    target, source = OccupancyGrid(GridFrame(0.1, SE2(), (50, 50)), known), full_grid(80, 80, 0.1)
    distances = [0.1 * math.hypot(row + 0.5, col + 0.5) for row in range(6, 9) for col in range(8, 12)]
    error = transform_error(target, source, Similarity2(), Similarity2(scale=1.1))
    assert error.displacement_m == pytest.approx(0.1 * np.mean(distances))
    assert error.displacement_of_diagonal == pytest.approx(0.1 * np.mean(distances) / (0.1 * 5))


def test_maps_without_a_common_cell_have_no_displacement_and_nothing_is_right():
    error = transform_error(full_grid(), full_grid(), Similarity2(50.0, 0.0), Similarity2(50.0, 0.0))
    assert error.displacement_m is None
    assert not RIGHT.holds(error)


@given(st.floats(-50, 50), st.floats(-50, 50))
def test_moving_the_target_frame_does_not_move_the_score(x, y):
    truth, answer = Similarity2(), Similarity2(0.02, -0.01, 0.01, 1.01)
    plain = transform_error(full_grid(), full_grid(), truth, answer)
    moved, shift = full_grid(origin=(x, y)), Similarity2(x, y)
    again = transform_error(moved, full_grid(), shift @ truth, shift @ answer)
    assert again.displacement_m == pytest.approx(plain.displacement_m, rel=0.02)
    assert again.rotation_deg == pytest.approx(plain.rotation_deg)


def test_criteria_have_the_documented_values():
    assert (RIGHT.rotation_deg, RIGHT.scale_percent, RIGHT.displacement_of_diagonal) == (2.0, 3.0, 0.015)
    assert (THESIS.rotation_deg, THESIS.scale_percent, THESIS.displacement_cells) == (5.0, 5.0, 10.0)


def test_a_normalised_error_by_hand():
    truth = Similarity2(1.0, 2.0, math.pi - 0.01, 1.0)
    answer = Similarity2(1.2, 1.9, -math.pi + 0.01, 1.1)
    covariance = np.diag([0.04, 0.01, 0.0001, 0.01])
    assert normalised_error(truth, answer, covariance) == pytest.approx(1.0 + 1.0 + 4.0 + 1.0)
    covariance[3, 3] = 0.0  # the scale is known
    assert normalised_error(truth, answer, covariance) == pytest.approx(6.0)


def test_errors_drawn_from_a_covariance_have_a_mean_square_equal_to_the_number_of_parameters():
    rng = np.random.default_rng(0)
    root = rng.standard_normal((4, 4)) * np.array([[3.0], [2.0], [1e-3], [1e-2]])
    truth = Similarity2(5.0, -3.0, 0.4, 1.3)
    found = []
    for x, y, yaw, scale in rng.standard_normal((4000, 4)) @ root.T:
        answer = Similarity2(truth.x + x, truth.y + y, truth.yaw + yaw, truth.scale + scale)
        found.append(normalised_error(truth, answer, root @ root.T))
    assert np.mean(found) == pytest.approx(4.0, abs=0.2)


def test_the_confidence_of_the_merger_uses_the_tolerance_of_the_score():
    assert math.radians(RIGHT.rotation_deg) == RIGHT_YAW
    assert math.log1p(RIGHT.scale_percent / 100.0) == pytest.approx(RIGHT_GROWTH, rel=1e-12)
