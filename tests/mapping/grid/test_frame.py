"""Cells, pixels and metres: half-cell offsets, flipped axes and inverted matrices."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.pixel_matrix import pixel_matrix, similarity_from_pixels

metres = st.floats(-20, 20)
angles = st.floats(-3.1, 3.1)
frames = st.builds(
    GridFrame,
    st.floats(0.01, 2.0),
    st.builds(SE2, metres, metres, angles),
    st.tuples(st.integers(1, 40), st.integers(1, 40)),
)
similarities = st.builds(Similarity2, metres, metres, angles, st.floats(0.2, 5))


def pixel_to_metre(frame, u, v):
    return (frame.metre_from_pixel() @ (u, v, 1.0))[:2]


@pytest.mark.parametrize("shape", [(1, 1), (2, 3), (7, 5)])
def test_lower_left_pixel_is_cell_zero(shape):
    frame = GridFrame(0.5, SE2(10.0, 20.0), shape)
    assert pixel_to_metre(frame, 0, shape[0] - 1) == pytest.approx([10.25, 20.25])
    assert frame.metres_from_cells([[0, 0]])[0] == pytest.approx([10.25, 20.25])


def test_top_right_pixel_by_hand():
    frame = GridFrame(1.0, SE2(0.0, 0.0), (2, 3))
    assert pixel_to_metre(frame, 2, 0) == pytest.approx([2.5, 1.5])


@given(frames, st.integers(0, 39), st.integers(0, 39))
def test_pixels_and_cells_have_the_same_coordinates(frame, row, col):
    cell = frame.metres_from_cells([[row, col]])[0]
    assert pixel_to_metre(frame, col, frame.shape[0] - 1 - row) == pytest.approx(cell, abs=1e-9)


@given(frames, st.integers(-5, 45), st.integers(-5, 45))
def test_centres_lie_in_their_cells(frame, row, col):
    assert frame.cells_from_metres(frame.metres_from_cells([[row, col]])).tolist() == [[row, col]]
    inside = 0 <= row < frame.shape[0] and 0 <= col < frame.shape[1]
    assert bool(frame.contains([[row, col]])[0]) == inside


@given(frames, frames, similarities)
def test_pixel_matrix_agrees_with_the_metric_transform(target, source, target_from_source):
    matrix = pixel_matrix(target, target_from_source, source)
    for u, v in [(0.0, 0.0), (3.0, 1.0), (-2.0, 5.0)]:
        through_metres = target_from_source.apply([pixel_to_metre(source, u, v)])[0]
        through_pixels = pixel_to_metre(target, *(matrix @ (u, v, 1.0)))
        assert through_pixels == pytest.approx(through_metres, abs=1e-6)


@given(frames, frames, similarities)
def test_similarity_round_trip_through_pixels(target, source, truth):
    back = similarity_from_pixels(target, pixel_matrix(target, truth, source), source)
    assert (back.x, back.y, back.scale) == pytest.approx((truth.x, truth.y, truth.scale), abs=1e-5)
    assert math.remainder(back.yaw - truth.yaw, math.tau) == pytest.approx(0.0, abs=1e-7)


def test_pixel_angle_has_the_opposite_sign_of_yaw():
    frame = GridFrame(1.0, SE2(), (10, 10))
    matrix = pixel_matrix(frame, Similarity2(yaw=0.3), frame)
    assert math.atan2(matrix[1, 0], matrix[0, 0]) == pytest.approx(-0.3)


@given(frames, frames, similarities, metres, metres)
def test_moving_both_origins_keeps_the_pixel_matrix(target, source, truth, dx, dy):
    moved_target = GridFrame(target.resolution, SE2(dx, dy) @ target.origin, target.shape)
    moved = Similarity2(dx, dy) @ truth
    assert np.allclose(pixel_matrix(moved_target, moved, source), pixel_matrix(target, truth, source), atol=1e-6)


@pytest.mark.parametrize("resolution", [0.0, -1.0, math.nan, math.inf])
def test_bad_resolution_is_refused(resolution):
    with pytest.raises(ValueError, match="resolution"):
        GridFrame(resolution, SE2(), (1, 1))


def test_empty_shape_is_refused():
    with pytest.raises(ValueError, match="shape"):
        GridFrame(1.0, SE2(), (0, 3))
