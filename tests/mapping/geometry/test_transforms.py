"""The group laws of SE2 and Similarity2, and answers worked out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2

metres = st.floats(-50, 50)
angles = st.floats(-math.pi, math.pi)
poses = st.builds(SE2, metres, metres, angles)
similarities = st.builds(Similarity2, metres, metres, angles, st.floats(0.2, 5))
points = np.array([[0.0, 0.0], [1.0, 0.0], [0.3, -2.0], [-7.0, 4.0]])


def close(a, b, tolerance=1e-9):
    return np.allclose(a.apply(points), b.apply(points), atol=tolerance * 1e3, rtol=0)


@given(poses, poses, poses)
def test_se2_is_a_group(a, b, c):
    assert close((a @ b) @ c, a @ (b @ c))
    assert close(a @ a.inverse(), SE2.identity())
    assert close(a.inverse() @ a, SE2.identity())
    assert np.allclose((a @ b).apply(points), a.apply(b.apply(points)))


@given(similarities, similarities, similarities)
def test_similarity_is_a_group(a, b, c):
    assert close((a @ b) @ c, a @ (b @ c), 1e-8)
    assert close(a @ a.inverse(), Similarity2.identity())
    assert close(a.inverse() @ a, Similarity2.identity())
    assert np.allclose((a @ b).apply(points), a.apply(b.apply(points)))
    assert (a @ b).scale == pytest.approx(a.scale * b.scale)


@given(similarities)
def test_similarity_matrix_round_trip(a):
    homogeneous = np.column_stack((points, np.ones(len(points))))
    assert np.allclose(homogeneous @ a.matrix().T, a.apply(points))
    assert close(Similarity2.from_matrix(a.matrix()), a)


def test_yaw_turns_counter_clockwise():
    assert np.allclose(SE2(0, 0, math.pi / 2).apply([[1.0, 0.0]]), [[0.0, 1.0]])


def test_product_of_poses_by_hand():
    world_from_base = SE2(2.0, 3.0, math.pi / 2)
    base_from_lidar = SE2(0.5, 0.0, math.pi)
    world_from_lidar = world_from_base @ base_from_lidar
    assert (world_from_lidar.x, world_from_lidar.y) == pytest.approx((2.0, 3.5))
    assert world_from_lidar.yaw == pytest.approx(-math.pi / 2)


def test_scale_is_left_metres_per_right_metre():
    true_from_stated = Similarity2(scale=0.5)
    assert np.allclose(true_from_stated.apply([[2.0, 4.0]]), [[1.0, 2.0]])
    assert true_from_stated.inverse().scale == pytest.approx(2.0)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_numbers_that_are_not_finite_are_refused(bad):
    with pytest.raises(ValueError, match="yaw"):
        SE2(0, 0, bad)
    with pytest.raises(ValueError, match="x is"):
        Similarity2(bad)


@pytest.mark.parametrize("scale", [0.0, -1.0])
def test_scale_must_be_positive(scale):
    with pytest.raises(ValueError, match="scale"):
        Similarity2(scale=scale)
